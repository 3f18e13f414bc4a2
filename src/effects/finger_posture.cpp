#include "factories.hpp"

namespace bodyschema::effects {
namespace {

/// The fingers are more curled than their encoders say: every finger joint stands further by
/// `curl`.
class FingerPosture final : public Clonable<FingerPosture> {
 public:
  FingerPosture(const EffectTarget& target, std::vector<Eigen::Index> fingers)
      : Clonable("finger_posture", target,
                 {EffectParameter{.name = "curl", .unit = "deg", .si_per_unit = kDeg, .typical = 5.0 * kDeg}}),
        fingers_(std::move(fingers)) {}
  void apply(const Instant&, Corrections& add_to) const override {
    for (const auto joint : fingers_) add_to.dq[joint] += value(0);
  }

 private:
  std::vector<Eigen::Index> fingers_;
};

}  // namespace

std::unique_ptr<Effect> make_finger_posture(const EffectTarget& target, const JointRoles& roles) {
  return std::make_unique<FingerPosture>(target, roles.fingers);
}

Targets finger_posture_targets(const JointRoles& roles) {
  return roles.fingers.empty() ? Targets{} : whole_robot(roles);
}

}  // namespace bodyschema::effects
