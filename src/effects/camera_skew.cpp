#include "kinds.hpp"
#include "words.hpp"

namespace bodyschema::effects {

/// The second camera's picture is taken later than the first's although their stamps agree; along the arm's path, as
/// latency is.
EffectKind camera_skew() {
  return {
      .name = "camera_skew",
      .targets = camera_pair_targets,
      .make = everywhere(
          "camera_skew", {in_ms("skew", 20.0)},
          [](Parameters p, const Instant& at, Corrections& c) {
            if (at.camera != 1) return;
            at.show_later(p[0].value, c);
          },
          Follows::kMotion),
      .sentence = in_words(
          "the second camera's pictures are taken {size} {later|earlier} than their stamps say, against the first's"),
      .not_testable =
          [](const EffectTarget& target, const JointRoles& roles, const LogMotion& motion) {
            const auto one = needs_two_cameras(target, roles, motion);
            return one.empty() ? too_slow(target, roles, motion) : one;
          },
      .lookalikes = {"latency", "backlash"},
      .splitting_motion = "Repeat the same path at two speeds and in both directions.",
      .remark = "stamp the second camera's pictures later by the skew"};
}

}  // namespace bodyschema::effects
