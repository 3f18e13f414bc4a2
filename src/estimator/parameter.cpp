#include "bodyschema/estimator/parameter.hpp"

#include "bodyschema/effects/effect.hpp"
#include "bodyschema/estimator/estimator_options.hpp"

namespace bodyschema {

const char* unit_of(ParameterKind kind) {
  switch (kind) {
    case ParameterKind::kJointOffset:
    case ParameterKind::kFingerCurl:
    case ParameterKind::kVergence: return "rad";
    case ParameterKind::kPrincipalDifferenceX:
    case ParameterKind::kPrincipalDifferenceY:
    case ParameterKind::kDilation: return "px";
    case ParameterKind::kFocalScale:
    case ParameterKind::kMeshScale: return "1";
  }
  return "1";
}

std::vector<Parameter> estimated_parameters(const std::shared_ptr<const RobotModel>& model, const RobotSetup& setup,
                                            const StereoRig& rig, const EstimatorOptions& options) {
  const RobotModel& robot = *model;
  std::vector<Parameter> parameters;
  for (const auto& name : setup.estimated_joints) {
    parameters.push_back({name, ParameterKind::kJointOffset, robot.joint_index(name), options.filter.initial_sd_rad});
  }
  if (options.mode == EstimatorMode::kPaper) return parameters;
  const NuisancePriors& priors = options.priors;
  if (priors.head_rad > 0.0) {
    // A joint of one eye alone changes the vergence, which is a parameter of its own.
    const auto roles = JointRoles::of(model, setup, rig);
    for (const auto joint : roles.neck) {
      const auto& name = roles.names[static_cast<std::size_t>(joint)];
      parameters.push_back({name, ParameterKind::kJointOffset, joint, priors.head_rad});
    }
  }
  const auto add = [&](const char* name, ParameterKind kind, double sd) {
    if (sd > 0.0) parameters.push_back({name, kind, -1, sd});
  };
  add("finger_curl", ParameterKind::kFingerCurl, priors.finger_curl_rad);
  if (rig.cameras.size() > 1) {
    add("vergence", ParameterKind::kVergence, priors.vergence_rad);
    add("principal_difference_x", ParameterKind::kPrincipalDifferenceX, priors.principal_difference_px);
    add("principal_difference_y", ParameterKind::kPrincipalDifferenceY, priors.principal_difference_px);
  }
  add("focal_scale", ParameterKind::kFocalScale, priors.focal_scale);
  add("mesh_scale", ParameterKind::kMeshScale, priors.mesh_scale);
  add("dilation", ParameterKind::kDilation, priors.dilation_px);
  return parameters;
}

}  // namespace bodyschema
