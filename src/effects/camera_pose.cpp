#include "kinds.hpp"

namespace bodyschema::effects {

/// The cameras, as they are fixed to each other, sit elsewhere than configured: moved along and turned about the first
/// camera's axes (x right, y down, z forward). The turn is a rotation vector.
EffectKind camera_pose() {
  return {.name = "camera_pose",
          .targets = whole_robot,
          .make = everywhere("camera_pose",
                             {in_mm("x", 5.0), in_mm("y", 5.0), in_mm("z", 5.0), in_degrees("turn_x", 0.5),
                              in_degrees("turn_y", 0.5), in_degrees("turn_z", 0.5)},
                             [](Parameters p, const Instant&, Corrections& c) {
                               c.camera.rig_shift_m += Eigen::Vector3d(p[0].value, p[1].value, p[2].value);
                               c.camera.rig_turn_rad += Eigen::Vector3d(p[3].value, p[4].value, p[5].value);
                             }),
          .sentence =
              [](const Effect& e, const JointRoles& roles, std::span<const std::string> amounts) {
                return std::string(roles.cameras.size() > 1 ? "the cameras sit" : "the camera sits") +
                       " otherwise than configured: " + camera_place(e.parameters(), amounts);
              },
          .lookalikes = {"head_offset", "base_shift", "principal_point"},
          .splitting_motion = "Move the first joint of the arm through its range, or the head by 20 to 30 deg.",
          .home = EffectHome::kUrdf};
}

}  // namespace bodyschema::effects
