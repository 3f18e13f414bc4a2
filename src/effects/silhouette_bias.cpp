#include "kinds.hpp"
#include "words.hpp"

namespace bodyschema::effects {

/// The observed outline lies outside the true one, of the whole body or of one segment: segmentation makes masks
/// fatter.
EffectKind silhouette_bias() {
  return {.name = "silhouette_bias",
          .targets = body_targets,
          .make =
              [](const EffectTarget& target, const JointRoles& roles) {
                return plain("silhouette_bias", target, {in_px("dilation", 0.5)},
                             [segments = segments_of(target, roles)](Parameters p, const Instant&, Corrections& c) {
                               for (const auto s : segments) c.shapes[s].dilation_px += p[0].value;
                             });
              },
          .sentence =
              [](const Effect& e, const JointRoles&, std::span<const std::string> amounts) {
                return "the outline " +
                       (e.target().source.empty() ? "" : "of " + part_in_words(e.target().source) + " ") +
                       "in the pictures lies " + amounts[0] + by_sign(e.parameters()[0], " outside", " inside") +
                       " that of the meshes";
              },
          .lookalikes = {"mesh_scale", "cover_thickness", "focal_length"},
          .splitting_motion = "Show the hand near and far, and from palm and back.",
          .remark = "belongs to the segmentation or to a cover that the meshes lack, not to the robot's joints"};
}

}  // namespace bodyschema::effects
