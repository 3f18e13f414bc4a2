#include "factories.hpp"

namespace bodyschema::effects {
namespace {

/// The hand carries a load that the URDF does not know: every arm joint gives way under it,
/// dq = compliance * mass * torque of one kilogram at the hand. The compliance is a setting (what
/// the robot's data sheet says); a log of one load alone cannot tell it from the mass.
class Payload final : public Clonable<Payload> {
 public:
  Payload(const EffectTarget& target, std::vector<Eigen::Index> arm)
      : Clonable("payload", target,
                 {EffectParameter{.name = "mass", .unit = "kg", .si_per_unit = 1.0, .typical = 0.25},
                  EffectParameter{.name = "compliance",
                                  .unit = "deg/Nm",
                                  .si_per_unit = kDeg,
                                  .value = 0.3 * kDeg,
                                  .fitted = false,
                                  .typical = 0.3 * kDeg}}),
        arm_(std::move(arm)) {}
  [[nodiscard]] bool follows_gravity() const override { return true; }
  void apply(const Instant& at, Corrections& add_to) const override {
    if (at.payload_torque.size() == 0) return;
    for (const auto joint : arm_) {
      add_to.dq[joint] += value(1) * value(0) * at.payload_torque[joint];
    }
  }

 private:
  std::vector<Eigen::Index> arm_;
};

}  // namespace

std::unique_ptr<Effect> make_payload(const EffectTarget& target, const JointRoles& roles) {
  return std::make_unique<Payload>(target, roles.arm);
}

Targets payload_targets(const JointRoles& roles) {
  return whole_robot(roles);
}

}  // namespace bodyschema::effects
