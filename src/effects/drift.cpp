#include <algorithm>

#include "kinds.hpp"
#include "words.hpp"

namespace bodyschema::effects {

/// The offset creeps evenly over a log and then stays where it ended: dq = change * (t - begin) /
/// duration within it.
EffectKind drift() {
  return {.name = "drift",
          .targets = arm_targets,
          .make = on_joint("drift",
                           {{.name = "change", .unit = "deg/log", .si_per_unit = kDeg, .typical = 0.5 * kDeg},
                            {.name = "begin", .unit = "s", .fitted = false},
                            {.name = "duration", .unit = "s", .value = 60.0, .fitted = false}},
                           [](Eigen::Index joint, Parameters p, const Instant& at, Corrections& c) {
                             if (p[2].value <= 0.0) return;
                             c.dq[joint] +=
                                 p[0].value * std::clamp((seconds(at.utime) - p[1].value) / p[2].value, 0.0, 1.0);
                           }),
          .sentence = in_words("the offset of {joint} creeps: {size} over the log{|, downwards}"),
          .not_testable = needs_motion_that_was_seen,
          .lookalikes = {"slip"},
          .splitting_motion = "Revisit the first postures in the middle and at the end of the log.",
          .timing = EffectTiming::kOverTheLog,
          .remark = "changes with time: the replay's offsets are those at its end; calibrate again"};
}

}  // namespace bodyschema::effects
