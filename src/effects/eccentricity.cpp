#include "kinds.hpp"

namespace bodyschema::effects {

/// The encoder disc is off centre: dq = a sin q + b cos q.
EffectKind eccentricity() {
  return {.name = "eccentricity",
          .targets = arm_targets,
          .make = on_joint("eccentricity", {in_degrees("sine", 0.5), in_degrees("cosine", 0.5)},
                           [](Eigen::Index joint, Parameters p, const Instant& at, Corrections& c) {
                             c.dq[joint] += p[0].value * std::sin(at.q[joint]) + p[1].value * std::cos(at.q[joint]);
                           }),
          .sentence =
              [](const Effect& e, const JointRoles&, std::span<const std::string> amounts) {
                return "the encoder disc of " + e.target().joint + " runs off centre: its error swings with the angle" +
                       " by " + amounts[0] + " (sine) and " + amounts[1] + " (cosine)";
              },
          .not_testable = joint_hardly_moved,
          .lookalikes = {"encoder_gain"},
          .splitting_motion = "Sweep the joint through more than 90 deg.",
          .remark = "add sine * sin q + cosine * cos q where the encoder is read"};
}

}  // namespace bodyschema::effects
