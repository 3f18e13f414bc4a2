#include "kinds.hpp"

namespace bodyschema::simulator::faults {

/// The drive of a joint gives way under the weight of the arm (and of what the hand holds): the joint
/// stands where the motor is plus compliance times the torque of gravity at the true posture.
FaultKind compliance() {
  FaultKind kind;
  kind.name = "compliance";
  kind.parameter = "compliance";
  kind.unit = "deg/Nm";
  kind.meaning = "true = motor + compliance * torque of gravity";
  kind.keys = {"joint"};
  kind.one_sided = true;
  kind.make = [](const FaultArguments& arguments, const FaultSite&) {
    const auto joint = arguments.joint();
    const double softness = radians(arguments.number("value", -20.0, 20.0));
    // The torque depends on the sagged posture. From step to step the last sag is a good guess; at
    // the first one the two are brought to agree.
    return transmission_fault([=, sag = 0.0, first = true](const MotorStep& step, Eigen::VectorXd& q) mutable {
      const double motor = q[joint];
      const int rounds = first ? 20 : 1;
      for (int i = 0; i < rounds; ++i) {
        q[joint] = motor + sag;
        sag = softness * step.torques.total(q)[joint];
      }
      q[joint] = motor + sag;
      first = false;
    });
  };
  kind.targets = [](const FaultSite& site) {
    // From the shoulder, where the whole arm pulls, to the elbow; the wrist carries too little.
    return on_arm_joints(site, "compliance", {0.1, 0.1, 0.3, 0.6, 0.0, 0.0, 0.0});
  };
  return kind;
}

}  // namespace bodyschema::simulator::faults
