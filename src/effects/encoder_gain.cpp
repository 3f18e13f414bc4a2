#include "factories.hpp"

namespace bodyschema::effects {
namespace {

/// The encoder's scale is wrong: dq = gain * q. The reference angle is zero; another reference
/// is another joint offset.
class EncoderGain final : public Clonable<EncoderGain> {
 public:
  EncoderGain(const EffectTarget& target, Eigen::Index joint)
      : Clonable("encoder_gain", target,
                 {EffectParameter{.name = "gain", .unit = "%", .si_per_unit = 0.01, .typical = 0.01}}),
        joint_(joint) {}
  void apply(const Instant& at, Corrections& add_to) const override { add_to.dq[joint_] += value(0) * at.q[joint_]; }

 private:
  Eigen::Index joint_;
};

}  // namespace

std::unique_ptr<Effect> make_encoder_gain(const EffectTarget& target, const JointRoles& roles) {
  return std::make_unique<EncoderGain>(target, roles.index(target.joint));
}

Targets encoder_gain_targets(const JointRoles& roles) {
  return arm_targets(roles);
}

}  // namespace bodyschema::effects
