#include "kinds.hpp"
#include "words.hpp"

namespace bodyschema::effects {

/// Radial distortion of all cameras that the configuration does not have.
EffectKind distortion() {
  return {.name = "distortion",
          .targets = whole_robot,
          .make = everywhere("distortion", {{.name = "k1", .unit = "1", .si_per_unit = 1.0, .typical = 0.05}},
                             [](Parameters p, const Instant&, Corrections& c) { c.camera.k1 += p[0].value; }),
          .sentence = in_words("the lens bends the picture {outwards|inwards} (k1) by {size} more than configured"),
          .lookalikes = {"focal_length", "mesh_scale"},
          .splitting_motion =
              "Show the hand at depths from 0.2 to 0.6 m and in the corners of the picture, or a checkerboard.",
          .home = EffectHome::kCameras};
}

}  // namespace bodyschema::effects
