#include <cmath>

#include "factories.hpp"

namespace bodyschema::effects {
namespace {

/// The encoder disc is off centre: dq = a sin q + b cos q.
class Eccentricity final : public Clonable<Eccentricity> {
 public:
  Eccentricity(const EffectTarget& target, Eigen::Index joint)
      : Clonable("eccentricity", target,
                 {EffectParameter{.name = "sine", .unit = "deg", .si_per_unit = kDeg, .typical = 0.5 * kDeg},
                  EffectParameter{.name = "cosine", .unit = "deg", .si_per_unit = kDeg, .typical = 0.5 * kDeg}}),
        joint_(joint) {}
  void apply(const Instant& at, Corrections& add_to) const override {
    const double q = at.q[joint_];
    add_to.dq[joint_] += value(0) * std::sin(q) + value(1) * std::cos(q);
  }

 private:
  Eigen::Index joint_;
};

}  // namespace

std::unique_ptr<Effect> make_eccentricity(const EffectTarget& target, const JointRoles& roles) {
  return std::make_unique<Eccentricity>(target, roles.index(target.joint));
}

Targets eccentricity_targets(const JointRoles& roles) {
  return arm_targets(roles);
}

}  // namespace bodyschema::effects
