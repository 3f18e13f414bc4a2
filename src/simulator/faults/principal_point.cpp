#include "kinds.hpp"

namespace bodyschema::simulator::faults {

/// A sensor sits off its lens's axis: the principal point moves.
FaultKind principal_point() {
  FaultKind kind;
  kind.name = "principal_point";
  kind.parameter = "shift";
  kind.unit = "px";
  kind.meaning =
      "true - nominal principal point along axis=x|y of source=left|right|common|difference "
      "(difference: left by half, right by minus half)";
  kind.keys = {"source", "axis"};
  kind.make = [](const FaultArguments& arguments, const FaultSite&) {
    const double shift = arguments.number("value", -200.0, 200.0);
    const auto shares = arguments.camera_shares();
    const bool along_x = arguments.choice_or("axis", "x", {"x", "y"}) == "x";
    return body_fault([=](TrueBody& body) {
      for (std::size_t c = 0; c < shares.size(); ++c) {
        auto& k = body.cameras[c].intrinsics;
        (along_x ? k.cx : k.cy) += shares[c] * shift;
      }
    });
  };
  kind.targets = [](const FaultSite& site) {
    std::vector<FaultTarget> targets;
    if (site.cameras < 2) return targets;
    // What shows is the difference between the eyes.
    for (const char* source : {"difference", "left", "right"}) {
      for (const char* axis : {"x", "y"}) {
        targets.push_back({FaultSpec{"principal_point", {{"source", source}, {"axis", axis}}}, 0.4});
      }
    }
    return targets;
  };
  return kind;
}

}  // namespace bodyschema::simulator::faults
