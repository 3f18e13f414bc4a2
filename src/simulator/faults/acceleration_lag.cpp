#include "kinds.hpp"

namespace bodyschema::simulator::faults {

/// Outside the catalogue: a soft drive lets the joint lag in proportion to the acceleration of what it
/// carries.
FaultKind acceleration_lag() {
  FaultKind kind;
  kind.name = "acceleration_lag";
  kind.parameter = "lag";
  kind.unit = "deg s^2/rad";
  kind.meaning = "true - motor = -lag * acceleration of the motor";
  kind.keys = {"joint"};
  kind.in_catalogue = false;
  kind.one_sided = true;
  kind.make = [](const FaultArguments& arguments, const FaultSite&) {
    const auto joint = arguments.joint();
    const double lag = radians(arguments.number("value", 0.0, 45.0));
    return transmission_fault(
        [=](const MotorStep& step, Eigen::VectorXd& q) { q[joint] -= lag * step.acceleration[joint]; });
  };
  kind.targets = [](const FaultSite& site) {
    return on_arm_joints(site, "acceleration_lag", {0.2, 0.2, 0.25, 0.25, 0.5, 0.4, 0.4});
  };
  return kind;
}

}  // namespace bodyschema::simulator::faults
