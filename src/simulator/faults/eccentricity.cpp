#include "kinds.hpp"

#include <cmath>

namespace bodyschema::simulator::faults {

/// The encoder's disc sits off its axis: true - encoder = sine * sin(encoder) + cosine * cos(encoder).
/// The disc turns with the true angle, so the reading is the solution of that equation.
FaultKind eccentricity() {
  FaultKind kind;
  kind.name = "eccentricity";
  kind.parameter = "sine";
  kind.unit = "deg";
  kind.meaning = "true - encoder = value * sin(encoder) + cosine_deg * cos(encoder)";
  kind.keys = {"joint", "cosine_deg"};
  kind.make = [](const FaultArguments& arguments, const FaultSite&) {
    const auto joint = arguments.joint();
    const double sine = radians(arguments.number("value", -10.0, 10.0));
    const double cosine = radians(arguments.number_or("cosine_deg", 0.0, -10.0, 10.0));
    return encoder_fault([=](Eigen::VectorXd& encoder) {
      const double turned = encoder[joint];
      double reading = turned;
      for (int i = 0; i < 20; ++i) {
        reading = turned - sine * std::sin(reading) - cosine * std::cos(reading);
      }
      encoder[joint] = reading;
    });
  };
  kind.targets = [](const FaultSite& site) {
    // Found by its slope and curvature, so of the size of the gain's over one radian.
    return on_arm_joints(site, "eccentricity", {0.3, 0.35, 0.45, 0.45, 0.7, 1.15, 1.15});
  };
  return kind;
}

}  // namespace bodyschema::simulator::faults
