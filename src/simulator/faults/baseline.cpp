#include "kinds.hpp"

namespace bodyschema::simulator::faults {

/// The right eye is mounted further to the right of the left one than drawn.
FaultKind baseline() {
  FaultKind kind;
  kind.name = "baseline";
  kind.parameter = "distance";
  kind.unit = "mm";
  kind.meaning = "true - nominal distance of the eyes; the right one moves";
  kind.make = [](const FaultArguments& arguments, const FaultSite&) {
    const double distance = 1e-3 * arguments.number("value", -50.0, 50.0);
    return body_fault([=](TrueBody& body) {
      if (body.X_CT.size() > 1) body.X_CT[1].translation().x() += distance;
    });
  };
  kind.targets = [](const FaultSite& site) {
    return site.cameras < 2 ? std::vector<FaultTarget>{} : on_robot("baseline", 0.4);
  };
  return kind;
}

}  // namespace bodyschema::simulator::faults
