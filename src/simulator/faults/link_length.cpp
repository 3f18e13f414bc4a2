#include "kinds.hpp"

namespace bodyschema::simulator::faults {

/// A bone is longer than drawn. The joint named turns about the bone's long axis (shoulder yaw: upper
/// arm; pronation: forearm); everything beyond it sits further out along that axis.
FaultKind link_length() {
  FaultKind kind;
  kind.name = "link_length";
  kind.parameter = "change";
  kind.unit = "mm";
  kind.meaning = "true - nominal length of the link that the joint turns about its long axis";
  kind.keys = {"joint"};
  kind.make = [](const FaultArguments& arguments, const FaultSite&) {
    const auto joint = arguments.joint();
    const double change = 1e-3 * arguments.number("value", -100.0, 100.0);
    return body_fault([=](TrueBody& body) { body.misplacements.push_back({.joint = joint, .lengthening_m = change}); });
  };
  kind.targets = [](const FaultSite& site) {
    if (site.arm.size() < 7) return std::vector<FaultTarget>{};
    return on_arm_joints(site, "link_length", {0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0});
  };
  return kind;
}

}  // namespace bodyschema::simulator::faults
