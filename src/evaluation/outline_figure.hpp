#pragma once

#include <Eigen/Core>
#include <filesystem>

#include "bodyschema/geometry/pose.hpp"
#include "bodyschema/pipeline/pipeline.hpp"

namespace bodyschema {

/// One picture's outlines, to be drawn without the picture.
struct OutlineView {
  std::filesystem::path mask;              ///< observed, 255: robot
  Eigen::VectorXd q_before, q_after;       ///< rad, order of the robot
  Pose X_root_optical = Pose::Identity();  ///< the camera as found
};

/// Draws observed outline (black), the model's before (red) and after (green) calibration on white, as a PNG.
/// Throws FileError.
void write_outline_figure(const Pipeline& robot, const PinholeIntrinsics& k, const OutlineView& view,
                          const std::filesystem::path& png);

}  // namespace bodyschema
