#include <algorithm>
#include <cstddef>

#include "kinds.hpp"
#include "words.hpp"

namespace bodyschema::effects {

/// The axis of a joint lies beside where the URDF has it, moved along the two directions about which
/// `axis_tilt` turns it (CorrectedKinematics::tilt_axis). All beyond the joint moves with it.
EffectKind axis_shift() {
  return {.name = "axis_shift",
          .targets =
              [](const JointRoles& roles) {
                // The first two of an arm look like a shifted base.
                auto targets = arm_targets(roles);
                targets.erase(targets.begin(),
                              targets.begin() + static_cast<std::ptrdiff_t>(std::min<std::size_t>(2, targets.size())));
                return targets;
              },
          .make = on_joint("axis_shift", {in_mm("shift_1", 3.0), in_mm("shift_2", 3.0)},
                           [](Eigen::Index joint, Parameters p, const Instant&, Corrections& c) {
                             c.adjustments[static_cast<std::size_t>(joint)].shift_1_m += p[0].value;
                             c.adjustments[static_cast<std::size_t>(joint)].shift_2_m += p[1].value;
                           }),
          .sentence =
              [](const Effect& e, const JointRoles&, std::span<const std::string> amounts) {
                return "the axis of " + e.target().joint + " lies beside where the URDF has it, by " + both(amounts);
              },
          .lookalikes = {"link_length", "base_shift"},
          .splitting_motion = "Move the joint and its neighbours one at a time through their full ranges.",
          .home = EffectHome::kUrdf};
}

}  // namespace bodyschema::effects
