#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "bodyschema/camera/stereo_rig.hpp"
#include "bodyschema/robot/robot_model.hpp"
#include "bodyschema/robot/robot_setup.hpp"

namespace bodyschema {

struct EstimatorOptions;

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

/// What an estimator with these options estimates: the offsets of the arm's joints and, in mode best,
/// every nuisance whose prior is not zero. Of the head's joints those that move all cameras; one that
/// turns one eye alone is the vergence.
std::vector<Parameter> estimated_parameters(const std::shared_ptr<const RobotModel>& robot, const RobotSetup& setup,
                                            const StereoRig& rig, const EstimatorOptions& options);

}  // namespace bodyschema
