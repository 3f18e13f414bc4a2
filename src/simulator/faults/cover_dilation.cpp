#include "kinds.hpp"

namespace bodyschema::simulator::faults {

/// A cover was moulded thicker than drawn, or wears a glove: its surface lies further out.
FaultKind cover_dilation() {
  FaultKind kind;
  kind.name = "cover_dilation";
  kind.parameter = "thickness";
  kind.unit = "mm";
  kind.meaning =
      "true - nominal distance of the surface along its normals, of part=all|hand|palm|fingers|forearm|upper_arm or "
      "links joined by '+'";
  kind.keys = {"part"};
  kind.in_catalogue = false;
  kind.make = [](const FaultArguments& arguments, const FaultSite&) {
    const double thickness = 1e-3 * arguments.number("value", -20.0, 50.0);
    const auto covers = arguments.covers();
    return body_fault([=](TrueBody& body) {
      for (const auto i : covers) body.covers[i].dilation_m += thickness;
    });
  };
  kind.targets = nowhere;
  return kind;
}

}  // namespace bodyschema::simulator::faults
