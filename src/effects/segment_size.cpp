#include "kinds.hpp"
#include "words.hpp"

namespace bodyschema::effects {

/// A segment with joints within is larger as a whole, the places of these joints with it: a hand of another size, whose
/// fingers begin further out. About the frame of the part that carries them, the palm.
EffectKind segment_size() {
  return {.name = "segment_size",
          .targets =
              [](const JointRoles& roles) {
                Targets targets;
                for (const auto& segment : roles.segments) {
                  if (!segment.inner.empty()) targets.push_back({"", segment.name});
                }
                return targets;
              },
          .make =
              [](const EffectTarget& target, const JointRoles& roles) {
                return plain("segment_size", target, {in_percent("scale", 1.0)},
                             [segments = segments_of(target, roles)](Parameters p, const Instant&, Corrections& c) {
                               for (const auto s : segments) c.shapes[s].size += p[0].value;
                             });
              },
          .sentence =
              [](const Effect& e, const JointRoles&, std::span<const std::string> amounts) {
                return part_in_words(e.target().source) + " is " + amounts[0] +
                       by_sign(e.parameters()[0], " larger", " smaller") +
                       " than in the URDF, the places of its joints with it";
              },
          .lookalikes = {"mesh_scale", "cover_thickness", "silhouette_bias"},
          .splitting_motion = "Show the hand near and far, from palm and back, and move the fingers.",
          .remark = "scale the segment's visual meshes and the origins of the joints between its links"};
}

}  // namespace bodyschema::effects
