#include "kinds.hpp"
#include "words.hpp"

namespace bodyschema::effects {

/// The encoder's scale is wrong: dq = gain * q. The reference angle is zero; another reference
/// is another joint offset.
EffectKind encoder_gain() {
  return {.name = "encoder_gain",
          .targets = arm_targets,
          .make = on_joint("encoder_gain", {in_percent("gain", 1.0)},
                           [](Eigen::Index joint, Parameters p, const Instant& at, Corrections& c) {
                             c.dq[joint] += p[0].value * at.q[joint];
                           }),
          .sentence = in_words("{joint} turns {size} {further|less far} than its encoder says"),
          .not_testable = joint_hardly_moved,
          .lookalikes = {"eccentricity"},
          .splitting_motion = "Sweep the joint through more than 90 deg.",
          .remark = "scale the reading, offset taken off, by 1 + gain where the encoder is read"};
}

}  // namespace bodyschema::effects
