#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

#include "bodyschema/camera/stereo_rig.hpp"
#include "bodyschema/geometry/pose.hpp"
#include "bodyschema/pipeline/pipeline.hpp"

namespace bodyschema {

/// One posture as a depth camera saw it.
struct DepthView {
  std::filesystem::path depth;  ///< 16 bit, mm along z, 0: none
  std::filesystem::path mask;   ///< 255: robot
  Eigen::VectorXd q;            ///< rad, order of the robot
};

/// Median distance, mm along the camera's z, between what a depth camera measured inside the masks and the model's
/// surface there. Pixels that show no model (a tool that no URDF has) do not count.
/// @param X_root_optical  the camera in the robot's root frame
double median_depth_distance_mm(const Pipeline& robot, const PinholeIntrinsics& k, const Pose& X_root_optical,
                                const std::vector<DepthView>& views);

}  // namespace bodyschema
