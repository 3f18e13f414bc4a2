#include "factories.hpp"

namespace bodyschema::effects {
namespace {

/// Both cameras' focal length is longer than configured.
class FocalLength final : public Clonable<FocalLength> {
 public:
  explicit FocalLength(const EffectTarget& target)
      : Clonable("focal_length", target,
                 {EffectParameter{.name = "scale", .unit = "%", .si_per_unit = 0.01, .typical = 0.01}}) {}
  void apply(const Instant&, Corrections& add_to) const override { add_to.camera.focal_scale += value(0); }
};

}  // namespace

std::unique_ptr<Effect> make_focal_length(const EffectTarget& target, const JointRoles&) {
  return std::make_unique<FocalLength>(target);
}

Targets focal_length_targets(const JointRoles& roles) {
  return whole_robot(roles);
}

}  // namespace bodyschema::effects
