#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "bodyschema/core/time.hpp"
#include "bodyschema/geometry/binary_mask.hpp"
#include "bodyschema/geometry/image.hpp"
#include "bodyschema/observation/corrections.hpp"

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
  Image image;             ///< the picture as received (gray or RGB), kept for overlays
  BinaryMask mask;         ///< the robot's silhouette, filled in by vision
  BinaryMask valid;        ///< pixels that count; empty: all
  /// Share of each pixel covered by the robot, 0 to 255, one per pixel in row order: the mask
  /// before thresholding, from which outlines are found to a fraction of a pixel. Empty: none.
  std::vector<std::uint8_t> coverage;
  /// What is known to differ from the robot's model at this exposure, joint offsets left out.
  /// Absent: nothing is known (no extended model).
  std::optional<Corrections> corrections;
};

/// Where the robot was when a camera looked, as far as it is known without looking: what its pose is
/// predicted from. Refers to its parts, which must outlive it.
struct Exposure {
  const Eigen::VectorXd& q;                  ///< encoders, RobotModel order, radians
  const Corrections* corrections = nullptr;  ///< beyond the joint offsets; null: none
  // Implicit: encoders alone, or a picture that brings both, are an exposure.
  Exposure(const Eigen::VectorXd& encoders, const Corrections* known = nullptr) : q(encoders), corrections(known) {}
  Exposure(const CameraObservation& seen)
      : q(seen.joints.q), corrections(seen.corrections ? &*seen.corrections : nullptr) {}
};

/// One synchronised instant: the unit that enters the estimator, whether it came from a live robot,
/// a recorded log or the simulator.
struct Observation {
  Microseconds utime = 0;  ///< of the first camera that is present
  /// One per camera of the rig; absent when that camera delivered nothing within the pairing window.
  std::vector<std::optional<CameraObservation>> cameras;
};

}  // namespace bodyschema
