#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace bodyschema {

/// A result in the forms in which people apply it.
struct Correction {
  /// encoder - true, by joint name, rad.
  std::vector<std::pair<std::string, double>> offsets_rad;
  std::vector<std::pair<std::string, double>> sd_rad;
  /// What was estimated beside them; head joints among them are corrected in the URDF too.
  std::vector<std::pair<std::string, double>> nuisances;
};

/// Reads the final offsets from a replay's `summary.json`. Throws FileError naming file and key.
Correction read_correction(const std::filesystem::path& summary);

/// A copy of the URDF that is right when it is fed the encoders as they are: every corrected joint's
/// origin is turned back by its offset about its axis (moved, for a sliding joint) and its limits
/// grow by it, so that FK_corrected(encoder) = FK_nominal(encoder - offset). Everything else stays
/// as it was. Relative mesh paths keep resolving only beside the original.
/// Throws FileError naming URDF and joint.
void write_corrected_urdf(const std::filesystem::path& urdf, const Correction& correction,
                          const std::filesystem::path& out);

/// Writes `offsets.yaml` (by joint, deg), `corrected.urdf` and `calibration_delta.txt` (what to add
/// to each joint's calibrationDelta in an iCub's calibrator file, deg) into `out`.
/// Returns the files, for people.
std::string export_correction(const std::filesystem::path& summary, const std::filesystem::path& urdf,
                              const std::filesystem::path& out);

}  // namespace bodyschema
