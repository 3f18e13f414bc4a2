#include <algorithm>

#include "factories.hpp"

namespace bodyschema::effects {
namespace {

/// The offset creeps evenly over a log and then stays where it ended: dq = change * (t - begin) /
/// duration within it.
class Drift final : public Clonable<Drift> {
 public:
  Drift(const EffectTarget& target, Eigen::Index joint)
      : Clonable("drift", target,
                 {EffectParameter{.name = "change", .unit = "deg/log", .si_per_unit = kDeg, .typical = 0.5 * kDeg},
                  EffectParameter{.name = "begin", .unit = "s", .fitted = false},
                  EffectParameter{.name = "duration", .unit = "s", .value = 60.0, .fitted = false}}),
        joint_(joint) {}
  void apply(const Instant& at, Corrections& add_to) const override {
    if (value(2) <= 0.0) return;
    add_to.dq[joint_] += value(0) * std::clamp((seconds(at.utime) - value(1)) / value(2), 0.0, 1.0);
  }

 private:
  Eigen::Index joint_;
};

}  // namespace

std::unique_ptr<Effect> make_drift(const EffectTarget& target, const JointRoles& roles) {
  return std::make_unique<Drift>(target, roles.index(target.joint));
}

Targets drift_targets(const JointRoles& roles) {
  return arm_targets(roles);
}

}  // namespace bodyschema::effects
