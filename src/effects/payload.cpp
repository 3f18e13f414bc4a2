#include "kinds.hpp"
#include "words.hpp"

namespace bodyschema::effects {

/// The hand carries a load that the URDF does not know: every arm joint gives way under it,
/// dq = compliance * mass * torque of one kilogram at the hand. The compliance is a setting (what
/// the robot's data sheet says); a log of one load alone cannot tell it from the mass.
EffectKind payload() {
  return {
      .name = "payload",
      .targets = whole_robot,
      .make =
          [](const EffectTarget& target, const JointRoles& roles) {
            return plain(
                "payload", target,
                {{.name = "mass", .unit = "kg", .si_per_unit = 1.0, .typical = 0.25},
                 {.name = "compliance",
                  .unit = "deg/Nm",
                  .si_per_unit = kDeg,
                  .value = 0.3 * kDeg,
                  .fitted = false,
                  .typical = 0.3 * kDeg}},
                [arm = roles.arm](Parameters p, const Instant& at, Corrections& c) {
                  if (at.payload_torque.size() == 0) return;
                  for (const auto joint : arm) c.dq[joint] += p[1].value * p[0].value * at.payload_torque[joint];
                },
                Follows::kGravity);
          },
      .sentence = in_words("the hand carries {size} {more|less} than the URDF says, if joints give way by 0.3 deg/Nm"),
      .not_testable = [](const EffectTarget&, const JointRoles&, const LogMotion& motion) -> std::string {
        return motion.has_masses ? "" : "the robot's URDF has no masses, so the arm's compliance is unknown";
      },
      .lookalikes = {"compliance"},
      .splitting_motion = "Record one log with and one without the load.",
      .remark = "the arm sags under the load; take the load off, or correct in the controller"};
}

}  // namespace bodyschema::effects
