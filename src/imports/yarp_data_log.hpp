#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "bodyschema/imports/log_builder.hpp"
#include "bodyschema/imports/yarp_import.hpp"
#include "bodyschema/core/error.hpp"
#include "bodyschema/core/time.hpp"

namespace bodyschema {

/// One line of a data.log: an encoder row or the name of a picture.
struct YarpLine {
  std::uint64_t number = 0;
  Microseconds utime = 0;
  std::vector<double> values;
  std::string picture;
};

/// What the data.log of one folder of a YARP recording holds, as yarpdatadumper writes it: a counter, one or
/// two stamps, and values or the name of a picture. Bad lines are left out and counted.
class YarpDataLog {
 public:
  /// @param key  of the configuration that names the folder
  /// @param encoders  null: a folder of pictures
  /// Throws FileError for a folder that is not there, a file that is empty or too large, and too many bad lines.
  YarpDataLog(const std::filesystem::path& recording, const std::string& folder, const std::string& key,
              const YarpImportOptions::Encoders* encoders);

  [[nodiscard]] const std::vector<YarpLine>& lines() const { return lines_; }
  [[nodiscard]] std::string where(std::uint64_t number) const { return file_.string() + ":" + std::to_string(number); }
  /// Of an encoder row.
  [[nodiscard]] std::size_t columns() const { return columns_; }
  [[nodiscard]] const LeftOut& bad() const { return bad_; }
  [[nodiscard]] std::uint64_t out_of_order() const { return out_of_order_; }

 private:
  [[nodiscard]] std::size_t usual_columns(std::istream& in) const;
  [[nodiscard]] std::size_t stamps_before(const std::vector<std::string>& words, std::size_t values) const;
  [[nodiscard]] bool stands_alone(Microseconds now) const;
  void take(const std::vector<std::string>& words, std::uint64_t number);

  std::filesystem::path file_;
  std::string key_;
  const YarpImportOptions::Encoders* encoders_;
  bool two_stamps_ = false;
  std::size_t columns_ = 0;
  std::vector<YarpLine> lines_;
  LeftOut bad_;
  std::uint64_t out_of_order_ = 0;
};

}  // namespace bodyschema
