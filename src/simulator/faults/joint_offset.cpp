#include "kinds.hpp"

namespace bodyschema::simulator::faults {

/// The zero of an encoder is wrong: encoder = true + offset, the paper's sign. Read after all other
/// encoder faults, so that it is what is left at their zero.
FaultKind joint_offset() {
  FaultKind kind;
  kind.name = "joint_offset";
  kind.parameter = "offset";
  kind.unit = "deg";
  kind.meaning = "encoder = true + offset";
  kind.keys = {"joint"};
  kind.stage = 1;
  kind.make = [](const FaultArguments& arguments, const FaultSite&) {
    const auto joint = arguments.joint();
    const double offset = radians(arguments.number("value", -90.0, 90.0));
    return encoder_fault([=](Eigen::VectorXd& encoder) { encoder[joint] += offset; });
  };
  kind.targets = [](const FaultSite& site) {
    return on_arm_joints(site, "joint_offset", {0.1, 0.1, 0.1, 0.1, 0.3, 0.2, 0.2});
  };
  return kind;
}

}  // namespace bodyschema::simulator::faults
