#include "kinds.hpp"

#include <algorithm>

namespace bodyschema::simulator::faults {

/// Play between motor and joint: the joint rests until the motor has crossed the slack, then is taken
/// along at half the width behind (play operator on the true joint).
FaultKind backlash() {
  FaultKind kind;
  kind.name = "backlash";
  kind.parameter = "width";
  kind.unit = "deg";
  kind.meaning = "full width of the play between motor and joint";
  kind.keys = {"joint"};
  kind.one_sided = true;
  kind.make = [](const FaultArguments& arguments, const FaultSite&) {
    const auto joint = arguments.joint();
    const double half = 0.5 * radians(arguments.number("value", 0.0, 45.0));
    return transmission_fault([=, rest = 0.0, first = true](const MotorStep&, Eigen::VectorXd& q) mutable {
      if (first) rest = q[joint];
      first = false;
      rest = std::clamp(rest, q[joint] - half, q[joint] + half);
      q[joint] = rest;
    });
  };
  kind.targets = [](const FaultSite& site) {
    return on_arm_joints(site, "backlash", {0.1, 0.15, 0.2, 0.2, 0.4, 0.3, 0.3});
  };
  return kind;
}

}  // namespace bodyschema::simulator::faults
