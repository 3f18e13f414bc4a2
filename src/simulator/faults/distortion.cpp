#include "kinds.hpp"

#include <algorithm>

namespace bodyschema::simulator::faults {

/// A lens bends more than configured, or both do: radial k1 unless another coefficient is named.
FaultKind distortion() {
  FaultKind kind;
  kind.name = "distortion";
  kind.parameter = "k1";
  kind.unit = "1";
  kind.meaning =
      "true - configured radial distortion k1 of source=left|right|common|difference (or another "
      "coefficient=k1|k2|p1|p2|k3)";
  kind.keys = {"source", "coefficient"};
  kind.make = [](const FaultArguments& arguments, const FaultSite&) {
    const double more = arguments.number("value", -0.4, 0.4);
    const std::vector<std::string> names = {"k1", "k2", "p1", "p2", "k3"};
    const auto name = arguments.choice_or("coefficient", "k1", names);
    const auto which = static_cast<std::size_t>(std::find(names.begin(), names.end(), name) - names.begin());
    const auto shares = arguments.camera_shares();
    return body_fault([=](TrueBody& body) {
      for (std::size_t c = 0; c < shares.size(); ++c) body.cameras[c].distortion[which] += shares[c] * more;
    });
  };
  kind.targets = [](const FaultSite&) { return on_robot("distortion", 0.026); };
  return kind;
}

}  // namespace bodyschema::simulator::faults
