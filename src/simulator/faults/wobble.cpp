#include "kinds.hpp"

#include <cmath>

namespace bodyschema::simulator::faults {

/// Outside the catalogue: a loose mount sways, and the joint with it, in its own slow rhythm.
FaultKind wobble() {
  FaultKind kind;
  kind.name = "wobble";
  kind.parameter = "amplitude";
  kind.unit = "deg";
  kind.meaning = "the joint sways by this with period `period` seconds (default 7)";
  kind.keys = {"joint", "period"};
  kind.in_catalogue = false;
  kind.one_sided = true;
  kind.make = [](const FaultArguments& arguments, const FaultSite& site) {
    const auto joint = arguments.joint();
    const double amplitude = radians(arguments.number("value", 0.0, 45.0));
    const double omega = 2.0 * kPi / arguments.number_or("period", 7.0, 0.05, 1e4);
    const double phase = Random(site.seed, "wobble").uniform(0.0, 2.0 * kPi);
    return transmission_fault(
        [=](const MotorStep& step, Eigen::VectorXd& q) { q[joint] += amplitude * std::sin(omega * step.t_s + phase); });
  };
  kind.targets = [](const FaultSite& site) {
    return on_arm_joints(site, "wobble", {0.2, 0.2, 0.2, 0.2, 0.4, 0.35, 0.35});
  };
  return kind;
}

}  // namespace bodyschema::simulator::faults
