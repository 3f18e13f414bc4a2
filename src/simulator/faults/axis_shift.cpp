#include "kinds.hpp"

namespace bodyschema::simulator::faults {

/// A joint's bearing sits in the wrong place on the link that carries it: its axis, and with it
/// everything beyond, is moved along the first or second direction perpendicular to it.
FaultKind axis_shift() {
  FaultKind kind;
  kind.name = "axis_shift";
  kind.parameter = "shift";
  kind.unit = "mm";
  kind.meaning = "true - nominal place of the joint's axis in its parent link along perpendicular 1 or 2 (along=1|2)";
  kind.keys = {"joint", "along"};
  kind.make = [](const FaultArguments& arguments, const FaultSite&) {
    JointMisplacement change;
    change.joint = arguments.joint();
    const double shift = 1e-3 * arguments.number("value", -100.0, 100.0);
    (arguments.choice_or("along", "1", {"1", "2"}) == "1" ? change.shift_1_m : change.shift_2_m) = shift;
    return body_fault([=](TrueBody& body) { body.misplacements.push_back(change); });
  };
  // Never drawn at random: one along a link is a link_length.
  kind.targets = [](const FaultSite&) { return std::vector<FaultTarget>{}; };
  return kind;
}

}  // namespace bodyschema::simulator::faults
