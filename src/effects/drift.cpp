#include "factories.hpp"

namespace bodyschema::effects {
namespace {

/// The offset creeps: dq = rate * (t - start).
class Drift final : public Clonable<Drift> {
 public:
  Drift(const EffectTarget& target, Eigen::Index joint)
      : Clonable("drift", target,
                 {EffectParameter{.name = "rate",
                                  .unit = "deg/min",
                                  .si_per_unit = kDeg / 60.0,
                                  .typical = 0.5 * kDeg / 60.0},
                  EffectParameter{.name = "start",
                                  .unit = "s",
                                  .si_per_unit = 1.0,
                                  .fitted = false,
                                  .typical = 0.0}}),
        joint_(joint) {}
  void apply(const Instant& at, Corrections& add_to) const override {
    add_to.dq[joint_] += value(0) * (seconds(at.utime) - value(1));
  }

 private:
  Eigen::Index joint_;
};

}  // namespace

std::unique_ptr<Effect> make_drift(const EffectTarget& target, const JointRoles& roles) {
  return std::make_unique<Drift>(target, roles.index(target.joint));
}

Targets drift_targets(const JointRoles& roles) { return arm_targets(roles); }

}  // namespace bodyschema::effects
