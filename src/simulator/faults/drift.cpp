#include "kinds.hpp"

#include <algorithm>

namespace bodyschema::simulator::faults {

/// A tendon creeps: the joint moves away from its motor steadily while the log lasts.
FaultKind drift() {
  FaultKind kind;
  kind.name = "drift";
  kind.parameter = "creep";
  kind.unit = "deg/log";
  kind.meaning = "true - motor grows linearly from 0 to this over the motion";
  kind.keys = {"joint"};
  kind.make = [](const FaultArguments& arguments, const FaultSite& site) {
    const auto joint = arguments.joint();
    const double creep = radians(arguments.number("value", -45.0, 45.0));
    const double begin = site.begin_s;
    const double duration = std::max(1e-3, site.end_s - site.begin_s);
    return transmission_fault([=](const MotorStep& step, Eigen::VectorXd& q) {
      q[joint] += creep * std::max(0.0, (step.t_s - begin) / duration);
    });
  };
  kind.targets = [](const FaultSite& site) {
    return on_arm_joints(site, "drift", {0.2, 0.2, 0.25, 0.25, 0.4, 0.35, 0.35});
  };
  return kind;
}

}  // namespace bodyschema::simulator::faults
