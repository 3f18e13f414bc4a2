#include "kinds.hpp"

namespace bodyschema::effects {

/// The cameras are further apart: the second lies that much further along its x axis.
EffectKind baseline() {
  return {.name = "baseline",
          .targets = [](const JointRoles& roles) { return roles.cameras.size() > 1 ? whole_robot(roles) : Targets{}; },
          .make =
              [](const EffectTarget& target, const JointRoles&) {
                return plain("baseline", target, {in_mm("distance", 1.0)},
                             [](Parameters p, const Instant& at, Corrections& c) {
                               if (at.camera == 1) c.camera.shift_m.x() += p[0].value;
                             });
              },
          .sentence =
              [](const Effect& e, const JointRoles&, std::span<const std::string> amounts) {
                return "the cameras are " + amounts[0] +
                       by_sign(e.parameters()[0], " further apart", " nearer together") + " than configured";
              },
          .not_testable = [](const EffectTarget&, const JointRoles&,
                             const LogMotion& motion) { return needs_two_cameras(motion); },
          .lookalikes = {"vergence", "principal_point", "camera_pair"},
          .splitting_motion =
              "Show the hand at depths from 0.2 to 0.6 m and in the corners of the picture, or a checkerboard.",
          .home = EffectHome::kUrdf};
}

}  // namespace bodyschema::effects
