#include "kinds.hpp"
#include "words.hpp"

namespace bodyschema::effects {

/// The image shows the past: at its stamp the arm was where the encoders were `delay` earlier, head and
/// arm alike, along the path that they took. Where that is not known, dq = -delay * velocity + delay^2 / 2 *
/// acceleration: without the second term 60 ms would be 0.2 deg off in an arm that babbles.
EffectKind latency() {
  return {.name = "latency",
          .targets = whole_robot,
          .make = everywhere(
              "latency", {in_ms("delay", 20.0)},
              [](Parameters p, const Instant& at, Corrections& c) { at.show_later(-p[0].value, c); }, Follows::kMotion),
          .sentence = in_words("pictures arrive {size} {late|early} against the encoders"),
          .not_testable = too_slow,
          .lookalikes = {"backlash", "camera_skew"},
          .splitting_motion = "Repeat the same path at two speeds and in both directions.",
          .remark = "stamp the pictures earlier by the delay"};
}

}  // namespace bodyschema::effects
