#include "factories.hpp"

namespace bodyschema::effects {
namespace {

/// The arm is mounted elsewhere, seen from the eyes: every part of it lies further along the root's
/// axes. Errors in the lengths between base and eyes look like this while torso and head stand still.
class BaseShift final : public Clonable<BaseShift> {
 public:
  explicit BaseShift(const EffectTarget& target) : Clonable("base_shift", target, {axis("x"), axis("y"), axis("z")}) {}
  void apply(const Instant&, Corrections& add_to) const override {
    add_to.base_shift_m += Eigen::Vector3d(value(0), value(1), value(2));
  }

 private:
  static EffectParameter axis(const char* name) {
    return {.name = name, .unit = "mm", .si_per_unit = 1e-3, .typical = 3e-3};
  }
};

}  // namespace

std::unique_ptr<Effect> make_base_shift(const EffectTarget& target, const JointRoles&) {
  return std::make_unique<BaseShift>(target);
}

Targets base_shift_targets(const JointRoles& roles) {
  return whole_robot(roles);
}

}  // namespace bodyschema::effects
