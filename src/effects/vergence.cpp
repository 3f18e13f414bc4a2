#include "kinds.hpp"
#include "words.hpp"

namespace bodyschema::effects {

/// The eyes look further inwards than their encoders say. vergence = left pan - right pan, as on
/// the iCub, so each eye turns by half of `angle`.
EffectKind vergence() {
  return {.name = "vergence",
          .targets = [](const JointRoles& roles) { return roles.has_pans() ? whole_robot(roles) : Targets{}; },
          .make =
              [](const EffectTarget& target, const JointRoles& roles) {
                return plain(
                    "vergence", target, {in_degrees("angle", 0.5)},
                    [left = roles.left_pan, right = roles.right_pan](Parameters p, const Instant&, Corrections& c) {
                      c.dq[left] += 0.5 * p[0].value;
                      c.dq[right] -= 0.5 * p[0].value;
                    });
              },
          .sentence = in_words("the eyes look {size} {further|less far} inwards than their encoders say"),
          .not_testable = needs_two_cameras,
          .lookalikes = {"principal_point", "baseline", "camera_pair", "first_camera"},
          .splitting_motion =
              "Show the hand at depths from 0.2 to 0.6 m and in the corners of the picture, or a checkerboard.",
          .home = EffectHome::kUrdf};
}

}  // namespace bodyschema::effects
