#include "kinds.hpp"

#include <algorithm>
#include <cmath>

namespace bodyschema::simulator::faults {

/// Outside the catalogue: a damaged tooth pushes the joint away near one angle.
FaultKind local_kink() {
  FaultKind kind;
  kind.name = "local_kink";
  kind.parameter = "height";
  kind.unit = "deg";
  kind.meaning =
      "true - motor is a bump of this height around `at_deg` (default: middle of the joint's "
      "motion) of standard width `width_deg` (default: a tenth of it)";
  kind.keys = {"joint", "at_deg", "width_deg"};
  kind.in_catalogue = false;
  kind.make = [](const FaultArguments& arguments, const FaultSite& site) {
    const auto joint = arguments.joint();
    double low = 0.0;
    double high = 0.0;
    if (site.trajectory != nullptr) {
      low = high = site.trajectory->position(site.begin_s)[joint];
      for (int i = 1; i <= 400; ++i) {
        const double t = site.begin_s + (site.end_s - site.begin_s) * i / 400.0;
        const double q = site.trajectory->position(t)[joint];
        low = std::min(low, q);
        high = std::max(high, q);
      }
    }
    const double height = radians(arguments.number("value", -45.0, 45.0));
    const double centre = radians(arguments.number_or("at_deg", degrees(0.5 * (low + high)), -360.0, 360.0));
    const double width =
        radians(arguments.number_or("width_deg", std::max(0.5, degrees(0.1 * (high - low))), 0.01, 360.0));
    return transmission_fault([=](const MotorStep&, Eigen::VectorXd& q) {
      const double x = (q[joint] - centre) / width;
      q[joint] += height * std::exp(-0.5 * x * x);
    });
  };
  kind.targets = [](const FaultSite& site) {
    return on_arm_joints(site, "local_kink", {0.3, 0.3, 0.3, 0.3, 0.6, 0.5, 0.5});
  };
  return kind;
}

}  // namespace bodyschema::simulator::faults
