#include "kinds.hpp"
#include "words.hpp"

namespace bodyschema::effects {

/// The observed outline lies outside the true one: segmentation makes masks fatter.
EffectKind silhouette_bias() {
  return {.name = "silhouette_bias",
          .targets = whole_robot,
          .make = everywhere("silhouette_bias", {in_px("dilation", 0.5)},
                             [](Parameters p, const Instant&, Corrections& c) {
                               for (auto& shape : c.shapes) shape.dilation_px += p[0].value;
                             }),
          .sentence = in_words("the outline in the pictures lies {size} {outside|inside} that of the meshes"),
          .lookalikes = {"mesh_scale", "cover_thickness", "focal_length"},
          .splitting_motion = "Show the hand near and far, and from palm and back.",
          .remark = "belongs to the segmentation, not to the robot's joints"};
}

}  // namespace bodyschema::effects
