#include "kinds.hpp"

namespace bodyschema::simulator::faults {

/// A camera sits beside its place in the URDF, or both do because what carries them is bent.
FaultKind camera_position() {
  FaultKind kind;
  kind.name = "camera_position";
  kind.parameter = "shift";
  kind.unit = "mm";
  kind.meaning =
      "true - nominal place along axis=x|y|z (right, down, forward) of source=left|right in its own frame, of both "
      "(common, axes of the first), or of left by half and right by minus half (difference)";
  kind.keys = {"source", "axis"};
  kind.in_catalogue = false;
  kind.make = [](const FaultArguments& arguments, const FaultSite&) {
    const double shift = 1e-3 * arguments.number("value", -500.0, 500.0);
    const auto axis = arguments.axis();
    const auto shares = arguments.camera_shares();
    const bool together =
        arguments.choice_or("source", "common", {"left", "right", "common", "difference"}) == "common";
    return body_fault([=](TrueBody& body) {
      if (together) {
        body.X_KT.pretranslate(shift * axis);
        return;
      }
      for (std::size_t c = 0; c < shares.size(); ++c) body.X_CT[c].pretranslate(shares[c] * shift * axis);
    });
  };
  kind.targets = nowhere;
  return kind;
}

}  // namespace bodyschema::simulator::faults
