#include "kinds.hpp"
#include "words.hpp"

namespace bodyschema::effects {

/// The axis of a joint is not quite where the URDF has it: it is turned by two small angles about
/// directions perpendicular to it (CorrectedKinematics::tilt_axis). The pose at joint angle zero
/// stays as it is, so what is left is the part that no offset can absorb.
EffectKind axis_tilt() {
  return {.name = "axis_tilt",
          .targets = arm_targets,
          .make = on_joint("axis_tilt", {in_degrees("tilt_1", 0.5), in_degrees("tilt_2", 0.5)},
                           [](Eigen::Index joint, Parameters p, const Instant&, Corrections& c) {
                             c.adjustments[static_cast<std::size_t>(joint)].tilt_1_rad += p[0].value;
                             c.adjustments[static_cast<std::size_t>(joint)].tilt_2_rad += p[1].value;
                           }),
          .sentence =
              [](const Effect& e, const JointRoles&, std::span<const std::string> amounts) {
                return "the axis of " + e.target().joint + " is tilted against the URDF's, by " + both(amounts);
              },
          .not_testable = joint_hardly_moved,
          .lookalikes = {"joint_coupling"},
          .splitting_motion = "Move the joint and its neighbours one at a time through their full ranges.",
          .home = EffectHome::kUrdf};
}

}  // namespace bodyschema::effects
