#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

namespace bodyschema {

/// What one number of the estimator's state does to the predicted pictures. Every kind is zero
/// when the robot is as its model says. Joint offsets follow the paper's sign: encoder = true +
/// offset, so q_true = q_encoder - offset. All others are true minus nominal.
enum class ParameterKind {
  kJointOffset,           ///< rad, one joint
  kFingerCurl,            ///< rad, added to every joint that curls a finger
  kVergence,              ///< rad, right camera turned about its y axis (towards the left one: positive)
  kFocalScale,            ///< relative change of both focal lengths
  kPrincipalDifferenceX,  ///< px, right minus left principal point, half to each camera
  kPrincipalDifferenceY,  ///< px, the same along y
  kMeshScale,             ///< relative change of size of every part about its own link origin
  kDilation,              ///< px, silhouettes larger than the model says (blur, threshold, paint)
};

/// "rad", "px" or "1" (relative).
const char* unit_of(ParameterKind kind);

/// One number of the state with what is believed about it before any picture.
struct Parameter {
  std::string name;  ///< joint name, or "finger_curl", "vergence", ...
  ParameterKind kind = ParameterKind::kJointOffset;
  Eigen::Index joint = -1;  ///< kJointOffset: index in RobotModel order
  double prior_sd = 0.0;    ///< in the unit of the kind
};

}  // namespace bodyschema
