#include "kinds.hpp"

namespace bodyschema::simulator::faults {

/// The lenses bend more than configured: k1 of both cameras.
FaultKind distortion() {
  FaultKind kind;
  kind.name = "distortion";
  kind.parameter = "k1";
  kind.unit = "1";
  kind.meaning = "true - configured radial distortion k1, both cameras";
  kind.make = [](const FaultArguments& arguments, const FaultSite&) {
    const double k1 = arguments.number("value", -0.4, 0.4);
    return body_fault([=](TrueBody& body) {
      for (auto& camera : body.cameras) camera.distortion[0] += k1;
    });
  };
  kind.targets = [](const FaultSite&) { return on_robot("distortion", 0.026); };
  return kind;
}

}  // namespace bodyschema::simulator::faults
