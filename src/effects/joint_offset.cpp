#include "kinds.hpp"

namespace bodyschema::effects {

/// encoder = true + offset (the paper's convention): dq = -offset.
EffectKind joint_offset() {
  return {.name = "joint_offset",
          .targets = arm_targets,
          .make =
              [](const EffectTarget& target, const JointRoles& roles) {
                return plain("joint_offset", target, {in_degrees("offset", 1.0)},
                             [joint = roles.index(target.joint)](Parameters p, const Instant&, Corrections& c) {
                               c.dq[joint] -= p[0].value;
                             });
              },
          .sentence =
              [](const Effect& e, const JointRoles&, std::span<const std::string> amounts) {
                return "the encoder of " + e.target().joint + " reads " + amounts[0] + " too " +
                       by_sign(e.parameters()[0], "much", "little");
              },
          .home = EffectHome::kUrdf};
}

}  // namespace bodyschema::effects
