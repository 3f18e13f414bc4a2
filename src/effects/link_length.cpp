#include <algorithm>

#include "kinds.hpp"
#include "words.hpp"

namespace bodyschema::effects {

/// A link of the arm is longer than nominal: the target, the joint at its far end, and all beyond lie further away
/// from the joint before it, along the line between the two. Or the joint that turns the link does: with its cover.
EffectKind link_length() {
  return {.name = "link_length",
          .targets =
              [](const JointRoles& roles) {
                Targets targets;
                for (const auto& link : roles.links) {
                  targets.push_back({roles.names[static_cast<std::size_t>(link.joint)], ""});
                }
                return targets;
              },
          .make =
              [](const EffectTarget& target, const JointRoles& roles) {
                const auto joint = roles.index(target.joint);
                const auto link = std::find_if(roles.links.begin(), roles.links.end(),
                                               [&](const ArmLink& l) { return l.joint == joint; });
                return plain("link_length", target, {in_mm("change", 2.0)},
                             [at = static_cast<std::size_t>(joint), step = link->per_metre](
                                 Parameters p, const Instant&, Corrections& c) {
                               c.adjustments[at].along_m += p[0].value * step.along_m;
                               c.adjustments[at].shift_1_m += p[0].value * step.shift_1_m;
                               c.adjustments[at].shift_2_m += p[0].value * step.shift_2_m;
                             });
              },
          .sentence =
              [](const Effect& e, const JointRoles& roles, std::span<const std::string> amounts) {
                const auto joint = roles.index(e.target().joint);
                const auto link = std::find_if(roles.links.begin(), roles.links.end(),
                                               [&](const ArmLink& l) { return l.joint == joint; });
                const auto part = part_in_words(link->name);
                // A link that is called by its place in the arm needs no more.
                const auto where = part.starts_with("the link ")
                                       ? std::string(", which ") + (link->takes_cover ? "turns with " : "ends at ") +
                                             e.target().joint + ","
                                       : std::string();
                const auto& length = e.parameters()[0];
                return part + where + " is " + amounts[0] + by_sign(length, " longer", " shorter") +
                       " than in the URDF" +
                       (link->takes_cover ? by_sign(length, ", its cover further out", ", its cover further in") : "");
              },
          .lookalikes = {"axis_shift"},
          .splitting_motion = "Show the hand near and far, and from palm and back.",
          .home = EffectHome::kUrdf};
}

}  // namespace bodyschema::effects
