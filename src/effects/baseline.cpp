#include "factories.hpp"

namespace bodyschema::effects {
namespace {

/// The eyes are further apart: the right camera lies that much further along its x axis.
class Baseline final : public Clonable<Baseline> {
 public:
  explicit Baseline(const EffectTarget& target)
      : Clonable("baseline", target,
                 {EffectParameter{.name = "distance", .unit = "mm", .si_per_unit = 1e-3, .typical = 1e-3}}) {}
  void apply(const Instant& at, Corrections& add_to) const override {
    if (at.camera == 1) add_to.camera.shift_x_m += value(0);
  }
};

}  // namespace

std::unique_ptr<Effect> make_baseline(const EffectTarget& target, const JointRoles&) {
  return std::make_unique<Baseline>(target);
}

Targets baseline_targets(const JointRoles& roles) {
  return whole_robot(roles);
}

}  // namespace bodyschema::effects
