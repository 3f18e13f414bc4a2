#include "kinds.hpp"
#include "words.hpp"

namespace bodyschema::effects {

/// The joint gives way under the torque of gravity: dq = compliance * torque. Positive: it sags.
EffectKind compliance() {
  return {
      .name = "compliance",
      .targets = arm_targets,
      .make = on_joint(
          "compliance", {{.name = "compliance", .unit = "deg/Nm", .si_per_unit = kDeg, .typical = 0.3 * kDeg}},
          [](Eigen::Index joint, Parameters p, const Instant& at, Corrections& c) {
            if (at.gravity_torque.size() > 0) c.dq[joint] += p[0].value * at.gravity_torque[joint];
          },
          Follows::kGravity),
      .sentence = in_words("{joint} {gives way|rises} under gravity's torque by {size}"),
      .not_testable = [](const EffectTarget& target, const JointRoles& roles, const LogMotion& motion) -> std::string {
        constexpr double kLeastTorque_nm = 0.05;
        if (!motion.has_masses) return "the robot's URDF has no masses";
        const double range = motion.torque_range_nm[roles.index(target.joint)];
        if (range >= kLeastTorque_nm) return {};
        return "gravity's torque on " + target.joint + " changed by " + short_number(range, 3) + " Nm";
      },
      .lookalikes = {"payload"},
      .splitting_motion = "Record one log with and one without the load.",
      .remark = "the joint gives way with gravity's torque, which depends on the posture"};
}

}  // namespace bodyschema::effects
