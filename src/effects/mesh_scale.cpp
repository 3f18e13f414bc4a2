#include "factories.hpp"

namespace bodyschema::effects {
namespace {

/// The real parts are larger than their meshes.
class MeshScale final : public Clonable<MeshScale> {
 public:
  explicit MeshScale(const EffectTarget& target)
      : Clonable("mesh_scale", target,
                 {EffectParameter{.name = "scale", .unit = "%", .si_per_unit = 0.01, .typical = 0.01}}) {}
  void apply(const Instant&, Corrections& add_to) const override { add_to.mesh_scale += value(0); }
};

}  // namespace

std::unique_ptr<Effect> make_mesh_scale(const EffectTarget& target, const JointRoles&) {
  return std::make_unique<MeshScale>(target);
}

Targets mesh_scale_targets(const JointRoles& roles) {
  return whole_robot(roles);
}

}  // namespace bodyschema::effects
