#include "kinds.hpp"
#include "words.hpp"

namespace bodyschema::effects {

/// The cameras are further apart: the second lies that much further along its x axis.
EffectKind baseline() {
  return {.name = "baseline",
          .targets = camera_pair_targets,
          .make = everywhere("baseline", {in_mm("distance", 1.0)},
                             [](Parameters p, const Instant& at, Corrections& c) {
                               if (at.camera == 1) c.camera.shift_m.x() += p[0].value;
                             }),
          .sentence = in_words("the cameras are {size} {further apart|nearer together} than configured"),
          .not_testable = needs_two_cameras,
          .lookalikes = {"vergence", "principal_point", "camera_pair", "first_camera"},
          .splitting_motion =
              "Show the hand at depths from 0.2 to 0.6 m and in the corners of the picture, or a checkerboard.",
          .home = EffectHome::kUrdf};
}

}  // namespace bodyschema::effects
