#include "factories.hpp"

namespace bodyschema::effects {
namespace {

/// A joint of neck or eyes stands elsewhere than its encoder says: dq = angle.
class HeadOffset final : public Clonable<HeadOffset> {
 public:
  HeadOffset(const EffectTarget& target, Eigen::Index joint)
      : Clonable("head_offset", target,
                 {EffectParameter{.name = "angle", .unit = "deg", .si_per_unit = kDeg, .typical = 1.0 * kDeg}}),
        joint_(joint) {}
  void apply(const Instant&, Corrections& add_to) const override { add_to.dq[joint_] += value(0); }

 private:
  Eigen::Index joint_;
};

}  // namespace

std::unique_ptr<Effect> make_head_offset(const EffectTarget& target, const JointRoles& roles) {
  return std::make_unique<HeadOffset>(target, roles.index(target.joint));
}

Targets head_offset_targets(const JointRoles& roles) {
  Targets targets;  // pans of the eyes belong to vergence
  for (const auto joint : roles.neck) targets.push_back({roles.names[static_cast<std::size_t>(joint)], ""});
  return targets;
}

}  // namespace bodyschema::effects
