#include "kinds.hpp"

namespace bodyschema::simulator::faults {

/// A joint's bearing is bored at a slant: its axis is turned in the link that carries it, about the
/// first or second direction perpendicular to it. The posture at angle zero stays.
FaultKind axis_tilt() {
  FaultKind kind;
  kind.name = "axis_tilt";
  kind.parameter = "tilt";
  kind.unit = "deg";
  kind.meaning = "turn of the joint's axis in its parent link about perpendicular 1 or 2 (about=1|2)";
  kind.keys = {"joint", "about"};
  kind.make = [](const FaultArguments& arguments, const FaultSite&) {
    JointMisplacement change;
    change.joint = arguments.joint();
    const double tilt = radians(arguments.number("value", -30.0, 30.0));
    (arguments.choice_or("about", "1", {"1", "2"}) == "1" ? change.tilt_1_rad : change.tilt_2_rad) = tilt;
    return body_fault([=](TrueBody& body) { body.misplacements.push_back(change); });
  };
  kind.targets = [](const FaultSite& site) {
    // Acts like a coupling of one per cent per 0.57 deg.
    std::vector<FaultTarget> targets;
    for (const char* about : {"1", "2"}) {
      for (auto& target : on_arm_joints(site, "axis_tilt", {0.3, 0.35, 0.4, 0.4, 0.7, 1.0, 1.0})) {
        target.spec.arguments["about"] = about;
        targets.push_back(target);
      }
    }
    return targets;
  };
  return kind;
}

}  // namespace bodyschema::simulator::faults
