#include "kinds.hpp"

namespace bodyschema::simulator::faults {

/// The fingers are more curled than their encoders say, all alike or those of one joint.
FaultKind finger_posture() {
  FaultKind kind;
  kind.name = "finger_posture";
  kind.parameter = "curl";
  kind.unit = "deg";
  kind.meaning = "true - encoder of every joint that curls a finger (or of one joint)";
  kind.keys = {"joint"};
  kind.make = [](const FaultArguments& arguments, const FaultSite& site) {
    auto joints = site.fingers;
    if (arguments.spec().arguments.contains("joint")) joints = {arguments.joint()};
    const double curl = radians(arguments.number("value", -60.0, 60.0));
    return transmission_fault([=](const MotorStep&, Eigen::VectorXd& q) {
      for (const auto joint : joints) q[joint] += curl;
    });
  };
  kind.targets = [](const FaultSite& site) {
    return site.fingers.empty() ? std::vector<FaultTarget>{} : on_robot("finger_posture", 0.1);
  };
  return kind;
}

}  // namespace bodyschema::simulator::faults
