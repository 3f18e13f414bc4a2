#include "kinds.hpp"
#include "words.hpp"

namespace bodyschema::effects {

/// The real parts are larger than their meshes: of the whole body or of one segment, each about its own frame.
EffectKind mesh_scale() {
  return {.name = "mesh_scale",
          .targets = body_targets,
          .make =
              [](const EffectTarget& target, const JointRoles& roles) {
                return plain("mesh_scale", target, {in_percent("scale", 1.0)},
                             [segments = segments_of(target, roles)](Parameters p, const Instant&, Corrections& c) {
                               for (const auto s : segments) c.shapes[s].scale += p[0].value;
                             });
              },
          .sentence =
              [](const Effect& e, const JointRoles&, std::span<const std::string> amounts) {
                return (e.target().source.empty() ? "all parts of the body are "
                                                  : part_in_words(e.target().source) + " is ") +
                       amounts[0] + by_sign(e.parameters()[0], " larger", " smaller") + " than in the meshes";
              },
          .lookalikes = {"cover_thickness", "silhouette_bias", "focal_length"},
          .splitting_motion = "Show the hand near and far, and from palm and back.",
          .remark = "scale the visual meshes; collision meshes may be right"};
}

}  // namespace bodyschema::effects
