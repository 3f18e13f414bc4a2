#include "factories.hpp"

namespace bodyschema::effects {
namespace {

/// The axis of a joint is not quite where the URDF has it: it is turned by two small angles about
/// directions perpendicular to it (CorrectedKinematics::tilt_axis). The pose at joint angle zero
/// stays as it is, so what is left is the part that no offset can absorb.
class AxisTilt final : public Clonable<AxisTilt> {
 public:
  AxisTilt(const EffectTarget& target, Eigen::Index joint)
      : Clonable("axis_tilt", target,
                 {EffectParameter{.name = "tilt_1", .unit = "deg", .si_per_unit = kDeg, .typical = 0.5 * kDeg},
                  EffectParameter{.name = "tilt_2", .unit = "deg", .si_per_unit = kDeg, .typical = 0.5 * kDeg}}),
        joint_(joint) {}
  void apply(const Instant&, Corrections& add_to) const override {
    auto& adjustment = add_to.adjustments[static_cast<std::size_t>(joint_)];
    adjustment.tilt_1_rad += value(0);
    adjustment.tilt_2_rad += value(1);
  }

 private:
  Eigen::Index joint_;
};

}  // namespace

std::unique_ptr<Effect> make_axis_tilt(const EffectTarget& target, const JointRoles& roles) {
  return std::make_unique<AxisTilt>(target, roles.index(target.joint));
}

Targets axis_tilt_targets(const JointRoles& roles) {
  return arm_targets(roles);
}

}  // namespace bodyschema::effects
