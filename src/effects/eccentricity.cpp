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
                const auto& p = e.parameters();
                return "the encoder disc of " + e.target().joint +
                       " runs off centre: its error swings with the angle, by " + amounts[0] +
                       by_sign(p[0], " times the sine", " times minus the sine") + " and " + amounts[1] +
                       by_sign(p[1], " times the cosine", " times minus the cosine");
              },
          .not_testable = joint_hardly_moved,
          .lookalikes = {"encoder_gain"},
          .splitting_motion = "Sweep the joint through more than 90 deg.",
          .remark = "add sine * sin q + cosine * cos q where the encoder is read"};
}

}  // namespace bodyschema::effects
