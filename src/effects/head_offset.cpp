#include "kinds.hpp"
#include "words.hpp"

namespace bodyschema::effects {

/// A joint of neck or eyes stands elsewhere than its encoder says: dq = angle. Pans of the eyes belong to vergence.
EffectKind head_offset() {
  return {.name = "head_offset",
          .targets = [](const JointRoles& roles) { return joint_targets(roles, roles.neck); },
          .make = on_joint(
              "head_offset", {in_degrees("angle", 1.0)},
              [](Eigen::Index joint, Parameters p, const Instant&, Corrections& c) { c.dq[joint] += p[0].value; }),
          .sentence = in_words("the head's joint {joint} stands {size} {further|less far} than its encoder says"),
          .lookalikes = {"principal_point", "base_shift", "camera_pose"},
          .splitting_motion = "Move the head by 20 to 30 deg with the arm still.",
          .home = EffectHome::kUrdf};
}

}  // namespace bodyschema::effects
