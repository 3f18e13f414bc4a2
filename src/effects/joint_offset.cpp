#include "factories.hpp"

namespace bodyschema::effects {
namespace {

/// encoder = true + offset (the paper's convention): dq = -offset.
class JointOffset final : public Clonable<JointOffset> {
 public:
  JointOffset(const EffectTarget& target, Eigen::Index joint)
      : Clonable("joint_offset", target,
                 {EffectParameter{.name = "offset", .unit = "deg", .si_per_unit = kDeg, .typical = 1.0 * kDeg}}),
        joint_(joint) {}
  void apply(const Instant&, Corrections& add_to) const override { add_to.dq[joint_] -= value(0); }

 private:
  Eigen::Index joint_;
};

}  // namespace

std::unique_ptr<Effect> make_joint_offset(const EffectTarget& target, const JointRoles& roles) {
  return std::make_unique<JointOffset>(target, roles.index(target.joint));
}

Targets joint_offset_targets(const JointRoles& roles) {
  return arm_targets(roles);
}

}  // namespace bodyschema::effects
