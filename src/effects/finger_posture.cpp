#include "kinds.hpp"
#include "words.hpp"

namespace bodyschema::effects {

/// The fingers are more curled than their encoders say: every finger joint stands further by
/// `curl`.
EffectKind finger_posture() {
  return {.name = "finger_posture",
          .targets = [](const JointRoles& roles) { return roles.fingers.empty() ? Targets{} : whole_robot(roles); },
          .make =
              [](const EffectTarget& target, const JointRoles& roles) {
                return plain("finger_posture", target, {in_degrees("curl", 5.0)},
                             [fingers = roles.fingers](Parameters p, const Instant&, Corrections& c) {
                               for (const auto joint : fingers) c.dq[joint] += p[0].value;
                             });
              },
          .sentence = in_words("the fingers are curled {size} {more|less} than their encoders say"),
          .lookalikes = {"mesh_scale"},
          .splitting_motion = "Show the hand near and far, and from palm and back.",
          .remark = "the finger encoders' zero; recalibrate the hand"};
}

}  // namespace bodyschema::effects
