#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "bodyschema/imports/log_builder.hpp"

namespace bodyschema {

/// A table of numbers with a line of names above it, as spreadsheets and scripts write it: separated by commas,
/// semicolons or tabs (whichever the first line has), names and numbers possibly in quotes. An empty field is NaN, and
/// so is one that holds no number, which whoever needs one there refuses (not_a_number). Empty columns at the end and
/// empty rows do not count; rows with too few or too many fields are left out and counted.
struct CsvTable {
  struct Row {
    std::uint64_t line = 0;   ///< of the file, from 1
    std::uint64_t place = 0;  ///< among all rows that hold something, from 0, those left out too
    std::vector<double> values;
    std::map<std::size_t, std::string> words;  ///< fields that hold something and no number, by column
  };
  std::filesystem::path file;
  std::vector<std::string> names;
  std::vector<Row> rows;
  LeftOut bad;

  static constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();
  /// Position of the first of these names that is a column; kNone: none is.
  [[nodiscard]] std::size_t find(std::initializer_list<const char*> wanted) const;
  [[nodiscard]] std::string where(const Row& row) const { return file.string() + ":" + std::to_string(row.line); }
  /// Of a field that holds words.
  [[nodiscard]] FileError not_a_number(const Row& row, std::size_t column) const;

  /// Throws FileError for a file that is missing, larger than 256 MiB, has no names, a name twice, no row, or too
  /// many bad ones (LeftOut::check).
  static CsvTable read(const std::filesystem::path& file);
};

}  // namespace bodyschema
