#include "kinds.hpp"

namespace bodyschema::simulator::faults {

/// The encoder's scale is wrong: from a reference angle on it counts 1 / (1 + gain) of the true turn,
/// so that true - encoder = gain * (encoder - reference).
FaultKind encoder_gain() {
  FaultKind kind;
  kind.name = "encoder_gain";
  kind.parameter = "gain";
  kind.unit = "%";
  kind.meaning = "true - encoder = gain * (encoder - reference_deg), reference 0 unless given";
  kind.keys = {"joint", "reference_deg"};
  kind.make = [](const FaultArguments& arguments, const FaultSite&) {
    const auto joint = arguments.joint();
    const double gain = 0.01 * arguments.number("value", -50.0, 50.0);
    const double reference = radians(arguments.number_or("reference_deg", 0.0, -360.0, 360.0));
    return encoder_fault(
        [=](Eigen::VectorXd& encoder) { encoder[joint] = reference + (encoder[joint] - reference) / (1.0 + gain); });
  };
  kind.targets = [](const FaultSite& site) {
    return on_arm_joints(site, "encoder_gain", {0.5, 0.6, 0.8, 0.8, 1.2, 2.0, 2.0});
  };
  return kind;
}

}  // namespace bodyschema::simulator::faults
