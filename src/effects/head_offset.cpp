#include "kinds.hpp"

namespace bodyschema::effects {

/// A joint of neck or eyes stands elsewhere than its encoder says: dq = angle. Pans of the eyes belong to vergence.
EffectKind head_offset() {
  return {.name = "head_offset",
          .targets = [](const JointRoles& roles) { return joint_targets(roles, roles.neck); },
          .make =
              [](const EffectTarget& target, const JointRoles& roles) {
                return plain("head_offset", target, {in_degrees("angle", 1.0)},
                             [joint = roles.index(target.joint)](Parameters p, const Instant&, Corrections& c) {
                               c.dq[joint] += p[0].value;
                             });
              },
          .sentence =
              [](const Effect& e, const JointRoles&, std::span<const std::string> amounts) {
                return "the head's joint " + e.target().joint + " stands " + amounts[0] + " " +
                       by_sign(e.parameters()[0], "further", "less far") + " than its encoder says";
              },
          .lookalikes = {"principal_point", "base_shift", "camera_pose"},
          .splitting_motion = "Move the head by 20 to 30 deg with the arm still.",
          .home = EffectHome::kUrdf};
}

}  // namespace bodyschema::effects
