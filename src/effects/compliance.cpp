#include "factories.hpp"

namespace bodyschema::effects {
namespace {

/// The joint gives way under the torque of gravity: dq = compliance * torque. Positive: it sags.
class Compliance final : public Clonable<Compliance> {
 public:
  Compliance(const EffectTarget& target, Eigen::Index joint)
      : Clonable("compliance", target,
                 {EffectParameter{.name = "compliance", .unit = "deg/Nm", .si_per_unit = kDeg, .typical = 0.3 * kDeg}}),
        joint_(joint) {}
  [[nodiscard]] bool follows_gravity() const override { return true; }
  void apply(const Instant& at, Corrections& add_to) const override {
    if (at.gravity_torque.size() > 0) add_to.dq[joint_] += value(0) * at.gravity_torque[joint_];
  }

 private:
  Eigen::Index joint_;
};

}  // namespace

std::unique_ptr<Effect> make_compliance(const EffectTarget& target, const JointRoles& roles) {
  return std::make_unique<Compliance>(target, roles.index(target.joint));
}

Targets compliance_targets(const JointRoles& roles) {
  return arm_targets(roles);
}

}  // namespace bodyschema::effects
