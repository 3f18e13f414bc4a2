#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "bodyschema/calibration/calibrate.hpp"
#include "bodyschema/pipeline/starter_configuration.hpp"

namespace bodyschema {

/// Joint angles of a folder of stills, as they are written.
struct JointTable {
  std::vector<std::string> columns;  ///< `posture` and the joints
  std::vector<std::vector<double>> rows;
  /// Throws FileError.
  static JointTable read(const std::filesystem::path& set);
  static JointTable read_file(const std::filesystem::path& file);
  /// Joint angles of one row.
  [[nodiscard]] std::map<std::string, double> row(std::size_t index) const;
};

/// What a trial hides in a recording.
struct Hidden {
  std::map<std::string, double> offsets_deg;  ///< by joint, added to joints.csv
  std::vector<std::int64_t> postures;         ///< that are handed over; empty: all
};

/// Offsets of all joints that are recorded, deg.
std::map<std::string, double> draw_offsets(const std::filesystem::path& set, std::uint64_t seed, double sd_deg);

/// One calibration of a folder of stills, and what was hidden in it.
struct RealTrial {
  Hidden hidden;
  Calibration calibration;
};

struct RealTrialOptions {
  std::filesystem::path set, urdf;
  Hidden hidden{};
  bool masks = true;                     ///< those of the set
  std::vector<std::string> overrides{};  ///< of the starter configuration, "KEY=VALUE"
};

/// The three commands of docs/calibrate_from_photographs.md on a copy of a set that holds neither camera poses nor
/// witnesses. `folder` is created.
RealTrial run_real_trial(const RealTrialOptions& options, const std::filesystem::path& folder);

}  // namespace bodyschema
