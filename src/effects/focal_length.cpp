#include "kinds.hpp"
#include "words.hpp"

namespace bodyschema::effects {

/// All cameras' focal length is longer than configured.
EffectKind focal_length() {
  return {.name = "focal_length",
          .targets = whole_robot,
          .make = everywhere("focal_length", {in_percent("scale", 1.0)},
                             [](Parameters p, const Instant&, Corrections& c) { c.camera.focal_scale += p[0].value; }),
          .sentence = in_words("the focal length is {size} {longer|shorter} than configured"),
          .lookalikes = {"mesh_scale", "camera_pose", "distortion"},
          .splitting_motion =
              "Show the hand at depths from 0.2 to 0.6 m and in the corners of the picture, or a checkerboard.",
          .home = EffectHome::kCameras};
}

}  // namespace bodyschema::effects
