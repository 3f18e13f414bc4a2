#include "kinds.hpp"

namespace bodyschema::effects {

/// All cameras' focal length is longer than configured.
EffectKind focal_length() {
  return {.name = "focal_length",
          .targets = whole_robot,
          .make =
              [](const EffectTarget& target, const JointRoles&) {
                return plain("focal_length", target, {in_percent("scale", 1.0)},
                             [](Parameters p, const Instant&, Corrections& c) { c.camera.focal_scale += p[0].value; });
              },
          .sentence =
              [](const Effect& e, const JointRoles&, std::span<const std::string> amounts) {
                return "the focal length is " + amounts[0] + by_sign(e.parameters()[0], " longer", " shorter") +
                       " than configured";
              },
          .lookalikes = {"mesh_scale", "camera_pose", "distortion"},
          .splitting_motion =
              "Show the hand at depths from 0.2 to 0.6 m and in the corners of the picture, or a checkerboard.",
          .home = EffectHome::kCameras};
}

}  // namespace bodyschema::effects
