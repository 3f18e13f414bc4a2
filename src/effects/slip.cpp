#include "factories.hpp"

namespace bodyschema::effects {
namespace {

/// The offset jumps at one time: dq = step from then on.
class Slip final : public Clonable<Slip> {
 public:
  Slip(const EffectTarget& target, Eigen::Index joint)
      : Clonable("slip", target,
                 {EffectParameter{.name = "step", .unit = "deg", .si_per_unit = kDeg, .typical = 1.0 * kDeg},
                  EffectParameter{.name = "time", .unit = "s", .si_per_unit = 1.0, .fitted = false, .typical = 0.0}}),
        joint_(joint) {}
  void apply(const Instant& at, Corrections& add_to) const override {
    if (seconds(at.utime) >= value(1)) add_to.dq[joint_] += value(0);
  }

 private:
  Eigen::Index joint_;
};

}  // namespace

std::unique_ptr<Effect> make_slip(const EffectTarget& target, const JointRoles& roles) {
  return std::make_unique<Slip>(target, roles.index(target.joint));
}

Targets slip_targets(const JointRoles& roles) {
  return arm_targets(roles);
}

}  // namespace bodyschema::effects
