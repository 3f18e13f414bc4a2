#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "bodyschema/core/time.hpp"
#include "bodyschema/geometry/pose.hpp"

namespace bodyschema {

/// Where the hand really was during a stretch of time.
struct TruthInstant {
  Microseconds begin = 0;  ///< first and last exposure time it holds for
  Microseconds end = 0;
  std::vector<Pose> X_CP;                     ///< hand base in each true camera
  std::vector<Eigen::Vector3d> fingertips_P;  ///< metres, hand frame; may be empty
};

/// Ground truth of a log, read only after the estimate is made: the simulator's `--truth` file or
/// the recording's truth.json.
class Truth {
 public:
  /// @param cameras  names of the robot's cameras, in its order
  /// Throws FileError naming file and key.
  static Truth load(const std::filesystem::path& file, const std::vector<std::string>& cameras = {"left", "right"});
  /// The instant that holds at `utime`, or nothing within 60 ms.
  [[nodiscard]] const TruthInstant* at(Microseconds utime) const;
  [[nodiscard]] const std::vector<TruthInstant>& instants() const { return instants_; }
  /// The offsets hidden in the encoders, by joint, where the file gives them (rad).
  [[nodiscard]] const std::vector<std::pair<std::string, double>>& offsets() const { return offsets_; }
  /// Names of the fingers, in the order of fingertips_P.
  [[nodiscard]] const std::vector<std::string>& fingers() const { return fingers_; }

 private:
  std::vector<TruthInstant> instants_;
  std::vector<std::pair<std::string, double>> offsets_;
  std::vector<std::string> fingers_;
};

}  // namespace bodyschema
