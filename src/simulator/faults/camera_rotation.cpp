#include "kinds.hpp"

namespace bodyschema::simulator::faults {

/// A camera looks elsewhere than its place in the URDF says, or both do because what carries them is bent.
FaultKind camera_rotation() {
  FaultKind kind;
  kind.name = "camera_rotation";
  kind.parameter = "angle";
  kind.unit = "deg";
  kind.meaning =
      "true - nominal turn about axis=x|y|z (right, down, forward) of source=left|right in its own frame, of both "
      "midway between them (common), or of left by half and right by minus half (difference)";
  kind.keys = {"source", "axis"};
  kind.in_catalogue = false;
  kind.make = [](const FaultArguments& arguments, const FaultSite&) {
    const double angle = radians(arguments.number("value", -45.0, 45.0));
    const auto axis = arguments.axis();
    const auto shares = arguments.camera_shares();
    const bool together =
        arguments.choice_or("source", "common", {"left", "right", "common", "difference"}) == "common";
    return body_fault([=](TrueBody& body) {
      if (together) {
        body.X_KT.rotate(Eigen::AngleAxisd(angle, axis));
        return;
      }
      for (std::size_t c = 0; c < shares.size(); ++c) body.X_CT[c].rotate(Eigen::AngleAxisd(shares[c] * angle, axis));
    });
  };
  kind.targets = nowhere;
  return kind;
}

}  // namespace bodyschema::simulator::faults
