#include "kinds.hpp"
#include "words.hpp"

namespace bodyschema::effects {

/// encoder = true + offset (the paper's convention): dq = -offset.
EffectKind joint_offset() {
  return {.name = "joint_offset",
          .targets = arm_targets,
          .make = on_joint(
              "joint_offset", {in_degrees("offset", 1.0)},
              [](Eigen::Index joint, Parameters p, const Instant&, Corrections& c) { c.dq[joint] -= p[0].value; }),
          .sentence = in_words("the encoder of {joint} reads {size} too {much|little}"),
          .home = EffectHome::kUrdf};
}

}  // namespace bodyschema::effects
