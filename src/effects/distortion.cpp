#include "kinds.hpp"

namespace bodyschema::effects {

/// Radial distortion of all cameras that the configuration does not have.
EffectKind distortion() {
  return {.name = "distortion",
          .targets = whole_robot,
          .make =
              [](const EffectTarget& target, const JointRoles&) {
                return plain("distortion", target, {{.name = "k1", .unit = "1", .si_per_unit = 1.0, .typical = 0.05}},
                             [](Parameters p, const Instant&, Corrections& c) { c.camera.k1 += p[0].value; });
              },
          .sentence =
              [](const Effect& e, const JointRoles&, std::span<const std::string> amounts) {
                return "the lens bends the picture " + std::string(by_sign(e.parameters()[0], "outwards", "inwards")) +
                       " (k1) by " + amounts[0] + " more than configured";
              },
          .lookalikes = {"focal_length", "mesh_scale"},
          .splitting_motion =
              "Show the hand at depths from 0.2 to 0.6 m and in the corners of the picture, or a checkerboard.",
          .home = EffectHome::kCameras};
}

}  // namespace bodyschema::effects
