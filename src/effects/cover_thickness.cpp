#include "kinds.hpp"
#include "words.hpp"

namespace bodyschema::effects {

/// A segment wears what its meshes lack: a cover, a glove.
EffectKind cover_thickness() {
  return {.name = "cover_thickness",
          .targets = segment_targets,
          .make =
              [](const EffectTarget& target, const JointRoles& roles) {
                return plain("cover_thickness", target, {in_mm("thickness", 1.0)},
                             [segments = segments_of(target, roles)](Parameters p, const Instant&, Corrections& c) {
                               for (const auto s : segments) c.shapes[s].thickness_m += p[0].value;
                             });
              },
          .sentence =
              [](const Effect& e, const JointRoles&, std::span<const std::string> amounts) {
                return "the surface of " + part_in_words(e.target().source) + " lies " + amounts[0] +
                       by_sign(e.parameters()[0], " outside", " inside") + " that of its meshes";
              },
          .lookalikes = {"mesh_scale", "segment_size", "silhouette_bias"},
          .splitting_motion = "Show the part near and far, and from several sides.",
          .remark = "a cover that the meshes lack, or meshes thicker than the part: put the real shape into the URDF"};
}

}  // namespace bodyschema::effects
