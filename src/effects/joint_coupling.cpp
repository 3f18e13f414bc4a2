#include <cstdlib>

#include "bodyschema/core/error.hpp"
#include "factories.hpp"

namespace bodyschema::effects {
namespace {

/// Tendons of one joint run past another: dq_joint = ratio * q_source.
class JointCoupling final : public Clonable<JointCoupling> {
 public:
  JointCoupling(const EffectTarget& target, Eigen::Index joint, Eigen::Index source)
      : Clonable("joint_coupling", target,
                 {EffectParameter{.name = "ratio", .unit = "%", .si_per_unit = 0.01, .typical = 0.02}}),
        joint_(joint), source_(source) {}
  void apply(const Instant& at, Corrections& add_to) const override { add_to.dq[joint_] += value(0) * at.q[source_]; }

 private:
  Eigen::Index joint_, source_;
};

/// Tendons are routed past the next joint or the one after it.
constexpr int kReach = 2;

}  // namespace

std::unique_ptr<Effect> make_joint_coupling(const EffectTarget& target, const JointRoles& roles) {
  if (target.joint == target.source) {
    throw ConfigurationError("joint_coupling of '" + target.joint + "': expected another joint as source");
  }
  return std::make_unique<JointCoupling>(target, roles.index(target.joint), roles.index(target.source));
}

Targets joint_coupling_targets(const JointRoles& roles) {
  Targets targets;
  const int n = static_cast<int>(roles.arm.size());
  const auto name = [&](int i) {
    return roles.names[static_cast<std::size_t>(roles.arm[static_cast<std::size_t>(i)])];
  };
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      if (i != j && std::abs(i - j) <= kReach) targets.push_back({name(i), name(j)});
    }
  }
  return targets;
}

}  // namespace bodyschema::effects
