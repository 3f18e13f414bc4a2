#include "factories.hpp"

namespace bodyschema::effects {
namespace {

/// A link is longer than nominal. The target is the joint that turns about the link's long axis
/// (shoulder yaw for the upper arm, wrist pronation for the forearm): all beyond it moves along
/// that axis, away from the root when `change` is positive.
class LinkLength final : public Clonable<LinkLength> {
 public:
  LinkLength(const EffectTarget& target, Eigen::Index joint)
      : Clonable("link_length", target,
                 {EffectParameter{.name = "change", .unit = "mm", .si_per_unit = 1e-3, .typical = 2e-3}}),
        joint_(joint) {}
  void apply(const Instant&, Corrections& add_to) const override {
    add_to.adjustments[static_cast<std::size_t>(joint_)].along_m += value(0);
  }

 private:
  Eigen::Index joint_;
};

}  // namespace

std::unique_ptr<Effect> make_link_length(const EffectTarget& target, const JointRoles& roles) {
  return std::make_unique<LinkLength>(target, roles.index(target.joint));
}

Targets link_length_targets(const JointRoles& roles) {
  // An arm of seven joints: roll-pitch-yaw shoulder, elbow, pronation, two wrist joints.
  Targets targets;
  for (const std::size_t i : {std::size_t{2}, std::size_t{4}}) {
    if (roles.arm.size() == 7) {
      targets.push_back({roles.names[static_cast<std::size_t>(roles.arm[i])], ""});
    }
  }
  return targets;
}

}  // namespace bodyschema::effects
