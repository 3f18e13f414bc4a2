#include "factories.hpp"

namespace bodyschema::effects {
namespace {

/// The eyes look further inwards than their encoders say. vergence = left pan - right pan, as on
/// the iCub, so each eye turns by half of `angle`.
class Vergence final : public Clonable<Vergence> {
 public:
  Vergence(const EffectTarget& target, Eigen::Index left, Eigen::Index right)
      : Clonable("vergence", target,
                 {EffectParameter{.name = "angle", .unit = "deg", .si_per_unit = kDeg, .typical = 0.5 * kDeg}}),
        left_(left), right_(right) {}
  void apply(const Instant&, Corrections& add_to) const override {
    add_to.dq[left_] += 0.5 * value(0);
    add_to.dq[right_] -= 0.5 * value(0);
  }

 private:
  Eigen::Index left_, right_;
};

}  // namespace

std::unique_ptr<Effect> make_vergence(const EffectTarget& target, const JointRoles& roles) {
  return std::make_unique<Vergence>(target, roles.left_pan, roles.right_pan);
}

Targets vergence_targets(const JointRoles& roles) {
  return roles.has_pans() ? Targets{EffectTarget{}} : Targets{};
}

}  // namespace bodyschema::effects
