#include "kinds.hpp"

namespace bodyschema::effects {

/// The offset jumps at one time: dq = step from then on.
EffectKind slip() {
  return {.name = "slip",
          .targets = arm_targets,
          .make =
              [](const EffectTarget& target, const JointRoles& roles) {
                return plain("slip", target,
                             {in_degrees("step", 1.0),
                              {.name = "time", .unit = "s", .si_per_unit = 1.0, .fitted = false, .typical = 0.0}},
                             [joint = roles.index(target.joint)](Parameters p, const Instant& at, Corrections& c) {
                               if (seconds(at.utime) >= p[1].value) c.dq[joint] += p[0].value;
                             });
              },
          .sentence =
              [](const Effect& e, const JointRoles&, std::span<const std::string> amounts) {
                return e.target().joint + " slipped by " + amounts[0] + by_sign(e.parameters()[0], "", ", backwards");
              },
          .not_testable = [](const EffectTarget&, const JointRoles&,
                             const LogMotion& motion) { return needs_motion_that_was_seen(motion); },
          .lookalikes = {"drift"},
          .splitting_motion = "Revisit the first postures in the middle and at the end of the log.",
          .timing = EffectTiming::kFromATime,
          .remark = "happened once: the replay's offsets are those after it"};
}

}  // namespace bodyschema::effects
