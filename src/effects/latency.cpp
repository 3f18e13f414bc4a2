#include "factories.hpp"

namespace bodyschema::effects {
namespace {

/// The image shows the past: at its stamp the arm was where the encoders were `delay` earlier, head and
/// arm alike. dq = -delay * velocity + delay^2 / 2 * acceleration; without the second term 60 ms would be
/// 0.2 deg off in an arm that babbles.
class Latency final : public Clonable<Latency> {
 public:
  explicit Latency(const EffectTarget& target)
      : Clonable("latency", target,
                 {EffectParameter{.name = "delay", .unit = "ms", .si_per_unit = 1e-3, .typical = 0.02}}) {}
  [[nodiscard]] bool follows_motion() const override { return true; }
  void apply(const Instant& at, Corrections& add_to) const override {
    add_to.dq.noalias() -= value(0) * at.qdot;
    add_to.dq.noalias() += 0.5 * value(0) * value(0) * at.qddot;
  }
};

}  // namespace

std::unique_ptr<Effect> make_latency(const EffectTarget& target, const JointRoles&) {
  return std::make_unique<Latency>(target);
}

Targets latency_targets(const JointRoles& roles) {
  return whole_robot(roles);
}

}  // namespace bodyschema::effects
