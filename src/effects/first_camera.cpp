#include "kinds.hpp"

namespace bodyschema::effects {

/// The first camera alone sits elsewhere on what carries it than configured: moved along and turned about its own axes.
/// Neither camera_pair nor camera_pose says so: they move the second alone, or both.
EffectKind first_camera() {
  return {.name = "first_camera",
          .targets = camera_pair_targets,
          .make = everywhere("first_camera",
                             {in_mm("x", 1.0), in_mm("y", 1.0), in_mm("z", 1.0), in_degrees("turn_x", 0.2),
                              in_degrees("turn_y", 0.2), in_degrees("turn_z", 0.2)},
                             [](Parameters p, const Instant& at, Corrections& c) {
                               if (at.camera != 0) return;
                               c.camera.shift_m += Eigen::Vector3d(p[0].value, p[1].value, p[2].value);
                               c.camera.turn_rad += Eigen::Vector3d(p[3].value, p[4].value, p[5].value);
                             }),
          .sentence =
              [](const Effect& e, const JointRoles& roles, std::span<const std::string> amounts) {
                return "camera '" + roles.cameras[0] + "' sits otherwise than configured, and '" + roles.cameras[1] +
                       "' does not: " + camera_place(e.parameters(), amounts);
              },
          .not_testable = needs_two_cameras,
          .lookalikes = {"camera_pair", "vergence", "baseline", "principal_point"},
          .splitting_motion =
              "Show the hand at depths from 0.2 to 0.6 m and in the corners of the picture, or a checkerboard.",
          .home = EffectHome::kUrdf};
}

}  // namespace bodyschema::effects
