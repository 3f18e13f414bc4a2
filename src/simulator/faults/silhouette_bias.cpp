#include "kinds.hpp"

namespace bodyschema::simulator::faults {

/// The camera blooms: the robot's picture spills over its outline (negative: the background's does).
FaultKind silhouette_bias() {
  FaultKind kind;
  kind.name = "silhouette_bias";
  kind.parameter = "dilation";
  kind.unit = "px";
  kind.meaning = "the outline in the picture lies this far outside the true one";
  kind.make = [](const FaultArguments& arguments, const FaultSite&) {
    const double dilation = arguments.number("value", -10.0, 10.0);
    return body_fault([=](TrueBody& body) { body.dilation_px += dilation; });
  };
  kind.targets = [](const FaultSite&) { return on_robot("silhouette_bias", 0.23); };
  return kind;
}

}  // namespace bodyschema::simulator::faults
