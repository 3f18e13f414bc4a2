#include "kinds.hpp"

#include <cmath>

namespace bodyschema::simulator::faults {

/// Outside the catalogue: one joint follows its motor through a damper and spring (first-order lag).
FaultKind velocity_lag() {
  FaultKind kind;
  kind.name = "velocity_lag";
  kind.parameter = "time_constant";
  kind.unit = "ms";
  kind.meaning = "one joint follows its motor with this time constant";
  kind.keys = {"joint"};
  kind.in_catalogue = false;
  kind.one_sided = true;
  kind.make = [](const FaultArguments& arguments, const FaultSite&) {
    const auto joint = arguments.joint();
    const double tau = 1e-3 * arguments.number("value", 0.0, 5000.0);
    return transmission_fault(
        [=, at = 0.0, last = 0.0, first = true](const MotorStep& step, Eigen::VectorXd& q) mutable {
          const double motor = q[joint];
          if (first) at = last = motor;
          first = false;
          if (tau > 0.0) {
            // Exact for a motor that moves evenly over the step.
            const double x = step.dt_s / tau;
            const double decay = std::exp(-x);
            const double slope = (motor - last) / step.dt_s;
            at = motor - slope * tau + (at - last + slope * tau) * decay;
          } else {
            at = motor;
          }
          last = motor;
          q[joint] = at;
        });
  };
  kind.targets = [](const FaultSite& site) {
    return on_arm_joints(site, "velocity_lag", {10.0, 10.0, 12.0, 12.0, 25.0, 20.0, 20.0});
  };
  return kind;
}

}  // namespace bodyschema::simulator::faults
