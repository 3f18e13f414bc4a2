#include "kinds.hpp"
#include "words.hpp"

namespace bodyschema::effects {

/// One joint of a finger stands elsewhere than its encoder says: dq = angle.
EffectKind finger_offset() {
  return {.name = "finger_offset",
          .targets = [](const JointRoles& roles) { return joint_targets(roles, roles.hand); },
          .make = on_joint(
              "finger_offset", {in_degrees("angle", 5.0)},
              [](Eigen::Index joint, Parameters p, const Instant&, Corrections& c) { c.dq[joint] += p[0].value; }),
          .sentence = in_words("the finger joint {joint} stands {size} {further|less far} than its encoder says"),
          .lookalikes = {"finger_posture"},
          .splitting_motion = "Show the hand from palm and back, and the finger beside the others.",
          .each_of = "finger_posture",
          .remark = "the zero of this finger's encoder; recalibrate the hand"};
}

}  // namespace bodyschema::effects
