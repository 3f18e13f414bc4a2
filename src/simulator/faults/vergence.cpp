#include "kinds.hpp"

#include "bodyschema/core/error.hpp"

namespace bodyschema::simulator::faults {

/// The eyes look further inwards than their encoders say; vergence is left pan minus right pan.
FaultKind vergence() {
  FaultKind kind;
  kind.name = "vergence";
  kind.parameter = "angle";
  kind.unit = "deg";
  kind.meaning = "true - encoder of left pan minus right pan";
  kind.stage = 1;
  kind.make = [](const FaultArguments& arguments, const FaultSite& site) {
    if (!site.left_pan || !site.right_pan) {
      throw ConfigurationError("fault 'vergence': this robot has no joint that turns one eye alone");
    }
    const auto left = *site.left_pan;
    const auto right = *site.right_pan;
    const double half = 0.5 * radians(arguments.number("value", -45.0, 45.0));
    return transmission_fault([=](const MotorStep&, Eigen::VectorXd& q) {
      q[left] += half;
      q[right] -= half;
    });
  };
  kind.targets = [](const FaultSite& site) {
    return site.left_pan && site.right_pan ? on_robot("vergence", 0.09) : std::vector<FaultTarget>{};
  };
  return kind;
}

}  // namespace bodyschema::simulator::faults
