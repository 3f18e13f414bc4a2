#include "kinds.hpp"

namespace bodyschema::effects {

/// The encoder's scale is wrong: dq = gain * q. The reference angle is zero; another reference
/// is another joint offset.
EffectKind encoder_gain() {
  return {.name = "encoder_gain",
          .targets = arm_targets,
          .make =
              [](const EffectTarget& target, const JointRoles& roles) {
                return plain("encoder_gain", target, {in_percent("gain", 1.0)},
                             [joint = roles.index(target.joint)](Parameters p, const Instant& at, Corrections& c) {
                               c.dq[joint] += p[0].value * at.q[joint];
                             });
              },
          .sentence =
              [](const Effect& e, const JointRoles&, std::span<const std::string> amounts) {
                return e.target().joint + " turns " + amounts[0] + by_sign(e.parameters()[0], " further", " less far") +
                       " than its encoder says";
              },
          .not_testable = [](const EffectTarget& target, const JointRoles& roles,
                             const LogMotion& motion) { return too_little_motion(target.joint, roles, motion); },
          .lookalikes = {"eccentricity"},
          .splitting_motion = "Sweep the joint through more than 90 deg.",
          .remark = "scale the reading, offset taken off, by 1 + gain where the encoder is read"};
}

}  // namespace bodyschema::effects
