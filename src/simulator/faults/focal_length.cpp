#include "kinds.hpp"

namespace bodyschema::simulator::faults {

/// Both lenses are longer than configured.
FaultKind focal_length() {
  FaultKind kind;
  kind.name = "focal_length";
  kind.parameter = "scale";
  kind.unit = "%";
  kind.meaning = "true focal length / nominal - 1, both cameras";
  kind.make = [](const FaultArguments& arguments, const FaultSite&) {
    const double scale = 1.0 + 0.01 * arguments.number("value", -50.0, 50.0);
    return body_fault([=](TrueBody& body) {
      for (auto& camera : body.cameras) {
        camera.intrinsics.fx *= scale;
        camera.intrinsics.fy *= scale;
      }
    });
  };
  kind.targets = [](const FaultSite&) { return on_robot("focal_length", 0.55); };
  return kind;
}

}  // namespace bodyschema::simulator::faults
