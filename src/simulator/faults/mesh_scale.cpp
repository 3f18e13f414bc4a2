#include "kinds.hpp"

namespace bodyschema::simulator::faults {

/// The covers are larger than drawn, each about its own link's frame; the joints are where they were.
FaultKind mesh_scale() {
  FaultKind kind;
  kind.name = "mesh_scale";
  kind.parameter = "scale";
  kind.unit = "%";
  kind.meaning =
      "true size of the meshes / nominal - 1, of part=all|hand|palm|fingers|forearm|upper_arm or links joined by '+'";
  kind.keys = {"part"};
  kind.make = [](const FaultArguments& arguments, const FaultSite&) {
    const double scale = 1.0 + 0.01 * arguments.number("value", -50.0, 50.0);
    const auto covers = arguments.covers();
    return body_fault([=](TrueBody& body) {
      for (const auto i : covers) body.covers[i].scale *= scale;
    });
  };
  kind.targets = [](const FaultSite&) { return on_robot("mesh_scale", 0.6); };
  return kind;
}

}  // namespace bodyschema::simulator::faults
