#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "bodyschema/core/time.hpp"
#include "bodyschema/geometry/binary_mask.hpp"
#include "bodyschema/geometry/image.hpp"

namespace bodyschema {

/// Encoder readings at one instant, RobotModel order, radians and radians per second. Joints that
/// the robot does not publish hold the configured fixed value and zero velocity.
struct JointSample {
  Microseconds utime = 0;
  Eigen::VectorXd q;
  Eigen::VectorXd qdot;
};

/// What one camera saw and where the encoders were when it saw it.
struct CameraObservation {
  Microseconds utime = 0;  ///< exposure time of this picture
  JointSample joints;      ///< encoders interpolated to `utime`
  Image image;             ///< as received (gray or RGB); straightened once its mask has been made
  Image
      given_mask{};  ///< what others say of each pixel (kMaskRobot and its like), as the lens bends it; empty: nothing
  BinaryMask mask;   ///< the robot's silhouette, filled in by vision
  BinaryMask valid;  ///< pixels that count; empty: all
  bool mask_is_given = false;  ///< `mask` is others' (given_mask), who know nothing of where the robot is predicted
  /// Share of each pixel covered by the robot, 0 to 255, one per pixel in row order: the mask
  /// before thresholding, from which outlines are found to a fraction of a pixel. Empty: none.
  std::vector<std::uint8_t> coverage;
};

/// One synchronised instant: the unit that enters the estimator, whether it came from a live robot,
/// a recorded log or the simulator.
struct Observation {
  Microseconds utime = 0;  ///< of the first camera that is present
  /// One per camera of the rig; absent when that camera delivered nothing within the pairing window.
  std::vector<std::optional<CameraObservation>> cameras;
  /// Encoder samples at their full rate since the observation before, in order of time; the last ones may be later than
  /// the exposures. Velocities zero. What has a memory or follows the motion lives on them.
  std::vector<JointSample> encoders;
  /// The samples before these are of another clock, or of another beginning of it.
  bool encoders_begin_anew = false;
};

}  // namespace bodyschema
