#include "kinds.hpp"

namespace bodyschema::effects {

/// The second camera sits elsewhere against the first than configured: moved along and turned about its own axes.
EffectKind camera_pair() {
  return {.name = "camera_pair",
          .targets = camera_pair_targets,
          .make = everywhere("camera_pair",
                             {in_mm("x", 1.0), in_mm("y", 1.0), in_mm("z", 1.0), in_degrees("turn_x", 0.2),
                              in_degrees("turn_y", 0.2), in_degrees("turn_z", 0.2)},
                             [](Parameters p, const Instant& at, Corrections& c) {
                               if (at.camera != 1) return;
                               c.camera.shift_m += Eigen::Vector3d(p[0].value, p[1].value, p[2].value);
                               c.camera.turn_rad += Eigen::Vector3d(p[3].value, p[4].value, p[5].value);
                             }),
          .sentence =
              [](const Effect& e, const JointRoles& roles, std::span<const std::string> amounts) {
                return "camera '" + roles.cameras[1] + "' sits otherwise against '" + roles.cameras[0] +
                       "' than configured: " + camera_place(e.parameters(), amounts);
              },
          .not_testable = needs_two_cameras,
          .lookalikes = {"first_camera", "vergence", "baseline", "principal_point"},
          .splitting_motion =
              "Show the hand at depths from 0.2 to 0.6 m and in the corners of the picture, or a checkerboard.",
          .home = EffectHome::kUrdf};
}

}  // namespace bodyschema::effects
