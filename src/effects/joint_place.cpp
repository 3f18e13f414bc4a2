#include "kinds.hpp"

namespace bodyschema::effects {

/// A joint, and all beyond it, sits beside where the URDF has it: along its axis and along the two directions about
/// which `axis_tilt` turns it (CorrectedKinematics::tilt_axis). What `link_length` and `axis_shift` say of one joint
/// together, for beliefs about every joint of an arm that nobody has measured; a first joint beside its place is a
/// shifted base.
EffectKind joint_place() {
  return {.name = "joint_place",
          .targets =
              [](const JointRoles& roles) {
                auto targets = arm_targets(roles);
                if (!targets.empty()) targets.erase(targets.begin());
                return targets;
              },
          .make = on_joint("joint_place", {in_mm("along", 1.0), in_mm("shift_1", 1.0), in_mm("shift_2", 1.0)},
                           [](Eigen::Index joint, Parameters p, const Instant&, Corrections& c) {
                             auto& adjustment = c.adjustments[static_cast<std::size_t>(joint)];
                             adjustment.along_m += p[0].value;
                             adjustment.shift_1_m += p[1].value;
                             adjustment.shift_2_m += p[2].value;
                           }),
          .sentence =
              [](const Effect& e, const JointRoles&, std::span<const std::string> amounts) {
                return e.target().joint + " sits beside where the URDF has it, by " + amounts[0] +
                       " along its axis and by " + amounts[1] + " and " + amounts[2] + " across it";
              },
          .home = EffectHome::kUrdf,
          .where_believed = true};
}

}  // namespace bodyschema::effects
