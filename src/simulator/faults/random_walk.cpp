#include "kinds.hpp"

#include <algorithm>
#include <cmath>

namespace bodyschema::simulator::faults {

/// Outside the catalogue: a joint wanders off without a plan (a random walk of its true angle).
FaultKind random_walk() {
  FaultKind kind;
  kind.name = "random_walk";
  kind.parameter = "spread";
  kind.unit = "deg/log";
  kind.meaning = "standard deviation of true - motor at the end of the motion";
  kind.keys = {"joint"};
  kind.in_catalogue = false;
  kind.one_sided = true;
  kind.make = [](const FaultArguments& arguments, const FaultSite& site) {
    const auto joint = arguments.joint();
    const double spread = radians(arguments.number("value", 0.0, 45.0));
    const double per_root_second = spread / std::sqrt(std::max(1e-3, site.end_s - site.begin_s));
    const double begin = site.begin_s;
    return transmission_fault(
        [=, at = 0.0, random = Random(site.seed, "random walk")](const MotorStep& step, Eigen::VectorXd& q) mutable {
          if (step.t_s >= begin) at += per_root_second * std::sqrt(step.dt_s) * random.normal();
          q[joint] += at;
        });
  };
  kind.targets = [](const FaultSite& site) {
    return on_arm_joints(site, "random_walk", {0.3, 0.3, 0.3, 0.3, 0.6, 0.5, 0.5});
  };
  return kind;
}

}  // namespace bodyschema::simulator::faults
