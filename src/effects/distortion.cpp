#include "factories.hpp"

namespace bodyschema::effects {
namespace {

/// Radial distortion of both cameras that the configuration does not have.
class Distortion final : public Clonable<Distortion> {
 public:
  explicit Distortion(const EffectTarget& target)
      : Clonable("distortion", target,
                 {EffectParameter{.name = "k1", .unit = "1", .si_per_unit = 1.0, .typical = 0.05}}) {}
  void apply(const Instant&, Corrections& add_to) const override { add_to.camera.k1 += value(0); }
};

}  // namespace

std::unique_ptr<Effect> make_distortion(const EffectTarget& target, const JointRoles&) {
  return std::make_unique<Distortion>(target);
}

Targets distortion_targets(const JointRoles& roles) {
  return whole_robot(roles);
}

}  // namespace bodyschema::effects
