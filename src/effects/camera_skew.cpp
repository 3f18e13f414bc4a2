#include "factories.hpp"

namespace bodyschema::effects {
namespace {

/// The right picture is taken later than the left one although their stamps agree; second order in time
/// as Latency is.
class CameraSkew final : public Clonable<CameraSkew> {
 public:
  explicit CameraSkew(const EffectTarget& target)
      : Clonable("camera_skew", target,
                 {EffectParameter{.name = "skew", .unit = "ms", .si_per_unit = 1e-3, .typical = 0.02}}) {}
  [[nodiscard]] bool follows_motion() const override { return true; }
  void apply(const Instant& at, Corrections& add_to) const override {
    if (at.camera != 1) return;
    add_to.dq.noalias() += value(0) * at.qdot;
    add_to.dq.noalias() += 0.5 * value(0) * value(0) * at.qddot;
  }
};

}  // namespace

std::unique_ptr<Effect> make_camera_skew(const EffectTarget& target, const JointRoles&) {
  return std::make_unique<CameraSkew>(target);
}

Targets camera_skew_targets(const JointRoles& roles) {
  return whole_robot(roles);
}

}  // namespace bodyschema::effects
