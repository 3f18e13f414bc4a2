#include "factories.hpp"

namespace bodyschema::effects {
namespace {

/// Segmentation makes the mask fatter: the observed outline lies outside the true one.
class SilhouetteBias final : public Clonable<SilhouetteBias> {
 public:
  explicit SilhouetteBias(const EffectTarget& target)
      : Clonable("silhouette_bias", target,
                 {EffectParameter{.name = "dilation", .unit = "px", .si_per_unit = 1.0, .typical = 0.5}}) {}
  void apply(const Instant&, Corrections& add_to) const override { add_to.dilation_px += value(0); }
};

}  // namespace

std::unique_ptr<Effect> make_silhouette_bias(const EffectTarget& target, const JointRoles&) {
  return std::make_unique<SilhouetteBias>(target);
}

Targets silhouette_bias_targets(const JointRoles& roles) {
  return whole_robot(roles);
}

}  // namespace bodyschema::effects
