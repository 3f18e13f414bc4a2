#include "kinds.hpp"

namespace bodyschema::simulator::faults {

/// The hand holds a thing, all the time or from a moment on. It has no weight here: that is a payload.
FaultKind held() {
  FaultKind kind;
  kind.name = "held";
  kind.parameter = "length";
  kind.unit = "mm";
  kind.meaning =
      "longest side of a thing=box|bottle|stick that is rigid with the hand (0: of usual size), there from `at` "
      "seconds after the motion begins (default 0: all the time)";
  kind.keys = {"thing", "at"};
  kind.in_catalogue = false;
  kind.one_sided = true;
  kind.make = [](const FaultArguments& arguments, const FaultSite&) {
    HeldThing thing;
    thing.length_m = 1e-3 * arguments.number_or("value", 0.0, 0.0, 1000.0);
    thing.from_s = arguments.number_or("at", 0.0, 0.0, 1e6);
    const auto name = arguments.choice_or("thing", "box", {"box", "bottle", "stick"});
    thing.kind = name == "box" ? HeldKind::kBox : name == "bottle" ? HeldKind::kBottle : HeldKind::kStick;
    return body_fault([=](TrueBody& body) { body.held = thing; });
  };
  kind.targets = nowhere;
  return kind;
}

}  // namespace bodyschema::simulator::faults
