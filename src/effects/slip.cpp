#include "kinds.hpp"
#include "words.hpp"

namespace bodyschema::effects {

/// The offset jumps at one time: dq = step from then on.
EffectKind slip() {
  return {.name = "slip",
          .targets = arm_targets,
          .make = on_joint("slip",
                           {in_degrees("step", 1.0),
                            {.name = "time", .unit = "s", .si_per_unit = 1.0, .fitted = false, .typical = 0.0}},
                           [](Eigen::Index joint, Parameters p, const Instant& at, Corrections& c) {
                             if (seconds(at.utime) >= p[1].value) c.dq[joint] += p[0].value;
                           }),
          .sentence = in_words("{joint} slipped by {size}{|, backwards}"),
          .not_testable = needs_motion_that_was_seen,
          .lookalikes = {"drift"},
          .splitting_motion = "Revisit the first postures in the middle and at the end of the log.",
          .timing = EffectTiming::kFromATime,
          .remark = "happened once: the replay's offsets are those after it"};
}

}  // namespace bodyschema::effects
