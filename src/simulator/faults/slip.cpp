#include "kinds.hpp"

namespace bodyschema::simulator::faults {

/// A joint slips on its shaft at one moment and stays so.
FaultKind slip() {
  FaultKind kind;
  kind.name = "slip";
  kind.parameter = "step";
  kind.unit = "deg";
  kind.meaning = "true - motor jumps by this at `at` seconds after the motion begins (default: half-way)";
  kind.keys = {"joint", "at"};
  kind.make = [](const FaultArguments& arguments, const FaultSite& site) {
    const auto joint = arguments.joint();
    const double step_rad = radians(arguments.number("value", -45.0, 45.0));
    const double half = 0.5 * (site.end_s - site.begin_s);
    const double at = site.begin_s + arguments.number_or("at", half, 0.0, 1e6);
    return transmission_fault([=](const MotorStep& step, Eigen::VectorXd& q) {
      if (step.t_s >= at) q[joint] += step_rad;
    });
  };
  kind.targets = [](const FaultSite& site) { return on_arm_joints(site, "slip", {0.2, 0.2, 0.3, 0.3, 0.8, 0.6, 0.6}); };
  return kind;
}

}  // namespace bodyschema::simulator::faults
