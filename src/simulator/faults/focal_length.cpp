#include "kinds.hpp"

namespace bodyschema::simulator::faults {

/// A lens is longer than configured, or both are.
FaultKind focal_length() {
  FaultKind kind;
  kind.name = "focal_length";
  kind.parameter = "scale";
  kind.unit = "%";
  kind.meaning = "true focal length / nominal - 1 of source=left|right|common|difference";
  kind.keys = {"source"};
  kind.make = [](const FaultArguments& arguments, const FaultSite&) {
    const double longer = 0.01 * arguments.number("value", -50.0, 50.0);
    const auto shares = arguments.camera_shares();
    return body_fault([=](TrueBody& body) {
      for (std::size_t c = 0; c < shares.size(); ++c) {
        body.cameras[c].intrinsics.fx *= 1.0 + shares[c] * longer;
        body.cameras[c].intrinsics.fy *= 1.0 + shares[c] * longer;
      }
    });
  };
  kind.targets = [](const FaultSite&) { return on_robot("focal_length", 0.55); };
  return kind;
}

}  // namespace bodyschema::simulator::faults
