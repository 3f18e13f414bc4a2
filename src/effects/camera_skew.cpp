#include "kinds.hpp"

namespace bodyschema::effects {

/// The right picture is taken later than the left one although their stamps agree; second order in time
/// as latency is.
EffectKind camera_skew() {
  return {.name = "camera_skew",
          .targets = whole_robot,
          .make =
              [](const EffectTarget& target, const JointRoles&) {
                return plain(
                    "camera_skew", target, {in_ms("skew", 20.0)},
                    [](Parameters p, const Instant& at, Corrections& c) {
                      if (at.camera != 1) return;
                      c.dq.noalias() += p[0].value * at.qdot;
                      c.dq.noalias() += 0.5 * p[0].value * p[0].value * at.qddot;
                    },
                    Follows::kMotion);
              },
          .sentence =
              [](const Effect& e, const JointRoles&, std::span<const std::string> amounts) {
                return "the second camera's pictures are taken " + amounts[0] +
                       by_sign(e.parameters()[0], " later", " earlier") + " than their stamps say, against the first's";
              },
          .not_testable =
              [](const EffectTarget&, const JointRoles&, const LogMotion& motion) {
                const auto one = needs_two_cameras(motion);
                return one.empty() ? too_slow(motion) : one;
              },
          .lookalikes = {"latency", "backlash"},
          .splitting_motion = "Repeat the same path at two speeds and in both directions.",
          .remark = "stamp the right camera's pictures later by the skew"};
}

}  // namespace bodyschema::effects
