#include <algorithm>
#include <cstddef>

#include "factories.hpp"

namespace bodyschema::effects {
namespace {

/// The axis of a joint lies beside where the URDF has it, moved along the two directions about which
/// `axis_tilt` turns it (CorrectedKinematics::tilt_axis): a length across a link, or along it, is
/// wrong. All beyond the joint moves with it.
class AxisShift final : public Clonable<AxisShift> {
 public:
  AxisShift(const EffectTarget& target, Eigen::Index joint)
      : Clonable("axis_shift", target, {shift("shift_1"), shift("shift_2")}), joint_(joint) {}
  void apply(const Instant&, Corrections& add_to) const override {
    auto& adjustment = add_to.adjustments[static_cast<std::size_t>(joint_)];
    adjustment.shift_1_m += value(0);
    adjustment.shift_2_m += value(1);
  }

 private:
  static EffectParameter shift(const char* name) {
    return {.name = name, .unit = "mm", .si_per_unit = 1e-3, .typical = 3e-3};
  }

  Eigen::Index joint_;
};

}  // namespace

std::unique_ptr<Effect> make_axis_shift(const EffectTarget& target, const JointRoles& roles) {
  return std::make_unique<AxisShift>(target, roles.index(target.joint));
}

Targets axis_shift_targets(const JointRoles& roles) {
  // The first two of an arm look like a shifted base.
  auto targets = arm_targets(roles);
  targets.erase(targets.begin(),
                targets.begin() + static_cast<std::ptrdiff_t>(std::min<std::size_t>(2, targets.size())));
  return targets;
}

}  // namespace bodyschema::effects
