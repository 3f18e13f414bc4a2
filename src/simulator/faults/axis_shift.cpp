#include "kinds.hpp"

#include "bodyschema/core/error.hpp"
#include "bodyschema/robot/forward_kinematics.hpp"

namespace bodyschema::simulator::faults {
namespace {

/// From the joint that moves the link before `joint` to `joint`, in that link's frame. Joints that lie in one place
/// with `joint` are passed over, as in a shoulder of three.
Eigen::Vector3d bone_direction(const FaultSite& site, Eigen::Index joint) {
  constexpr double kSamePlace_m = 1e-3;
  const auto& info = site.model->joints()[static_cast<std::size_t>(joint)];
  ForwardKinematics kinematics(site.model, {info.parent_link, info.child_link});
  std::array<Pose, 2> X_WL;
  kinematics.compute(Eigen::VectorXd::Zero(site.model->joint_count()), X_WL);
  const Eigen::Vector3d end_W = kinematics.joint_axis(joint).point_W;
  for (Eigen::Index before = joint; before-- > 0;) {
    if (!kinematics.moves(before, 0)) continue;
    const Eigen::Vector3d bone_W = end_W - kinematics.joint_axis(before).point_W;
    if (bone_W.norm() > kSamePlace_m) return X_WL[0].linear().transpose() * bone_W.normalized();
  }
  throw ConfigurationError("fault 'axis_shift': along is 'bone', but no joint before '" + info.name +
                           "' lies in another place; expected 1, 2, x, y or z");
}

}  // namespace

/// A joint's bearing sits in the wrong place on the link that carries it, which is longer, wider or higher than
/// drawn: the joint's axis, and with it everything beyond, is moved along one of the link's directions.
FaultKind axis_shift() {
  FaultKind kind;
  kind.name = "axis_shift";
  kind.parameter = "shift";
  kind.unit = "mm";
  kind.meaning =
      "true - nominal place of the joint's axis in its parent link: along perpendicular 1 or 2 (along=1|2), along an "
      "axis of that link (x|y|z), or away from the joint before it (bone)";
  kind.keys = {"joint", "along"};
  kind.make = [](const FaultArguments& arguments, const FaultSite& site) {
    JointMisplacement change;
    change.joint = arguments.joint();
    const double shift = 1e-3 * arguments.number("value", -100.0, 100.0);
    const auto along = arguments.choice_or("along", "1", {"1", "2", "x", "y", "z", "bone"});
    if (along == "1") change.shift_1_m = shift;
    if (along == "2") change.shift_2_m = shift;
    if (along == "x" || along == "y" || along == "z") change.shift_P[along[0] - 'x'] = shift;
    if (along == "bone") change.shift_P = shift * bone_direction(site, change.joint);
    return body_fault([=](TrueBody& body) { body.misplacements.push_back(change); });
  };
  // Never drawn at random: one along a link is a link_length.
  kind.targets = [](const FaultSite&) { return std::vector<FaultTarget>{}; };
  return kind;
}

}  // namespace bodyschema::simulator::faults
