#include <algorithm>

#include "kinds.hpp"

namespace bodyschema::effects {
namespace {

const Mount& mount_of(const EffectTarget& target, const JointRoles& roles) {
  const auto joint = roles.index(target.joint);
  return *std::find_if(roles.mounts.begin(), roles.mounts.end(), [&](const Mount& m) { return m.joint == joint; });
}

}  // namespace

/// A hand or tool is not screwed on the arm's last link as the URDF has it: turned about the line from that link's
/// origin to its own, and further out. A bolt circle allows tens of degrees; flat faces allow little else. No offset of
/// the wrist's joints makes up for it: these turn the arm's last link too. Joint: the one that turns that link.
EffectKind hand_mount() {
  return {.name = "hand_mount",
          .targets =
              [](const JointRoles& roles) {
                Targets targets;
                for (const auto& mount : roles.mounts) {
                  targets.push_back({roles.names[static_cast<std::size_t>(mount.joint)], ""});
                }
                return targets;
              },
          .make =
              [](const EffectTarget& target, const JointRoles& roles) {
                const auto& mount = mount_of(target, roles);
                return plain("hand_mount", target, {in_mm("out", 3.0), in_degrees("roll", 5.0)},
                             [joint = static_cast<std::size_t>(mount.joint), axis = mount.axis](
                                 Parameters p, const Instant&, Corrections& c) {
                               c.adjustments[joint].mount_shift_m += p[0].value * axis;
                               c.adjustments[joint].mount_turn_rad += p[1].value * axis;
                             });
              },
          .sentence =
              [](const Effect& e, const JointRoles& roles, std::span<const std::string> amounts) {
                const auto& out = e.parameters()[0];
                return mount_of(e.target(), roles).link + " is not mounted on the link of " + e.target().joint +
                       " as in the URDF: it is turned by " + amounts[1] + " " +
                       by_sign(e.parameters()[1], "anticlockwise", "clockwise") + ", seen from its tip, and sits " +
                       amounts[0] + by_sign(out, " further out", " further in");
              },
          .home = EffectHome::kUrdf,
          .where_believed = true};
}

}  // namespace bodyschema::effects
