#include "kinds.hpp"

namespace bodyschema::simulator::faults {

/// A hand of another size, about the hand link's frame: palm, fingers, and where the fingers begin.
FaultKind hand_size() {
  FaultKind kind;
  kind.name = "hand_size";
  kind.parameter = "scale";
  kind.unit = "%";
  kind.meaning = "true size of all that the arm's last joint moves / nominal - 1, the places of its joints with it";
  kind.in_catalogue = false;
  kind.make = [](const FaultArguments& arguments, const FaultSite& site) {
    const double scale = 1.0 + 0.01 * arguments.number("value", -50.0, 50.0);
    const auto covers = site.covers_of("hand");
    return body_fault([=](TrueBody& body) {
      for (const auto i : covers) {
        body.covers[i].scale *= scale;
        body.covers[i].reach *= scale;
      }
    });
  };
  kind.targets = nowhere;
  return kind;
}

}  // namespace bodyschema::simulator::faults
