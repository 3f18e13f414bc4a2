#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>

#include "bodyschema/effects/effect_kind.hpp"
#include "bodyschema/geometry/pose.hpp"

namespace bodyschema::test {

/// An effect that the software does not know: a gear's ripple, dq = ripple * sin(q).
inline constexpr const char* kOwnEffect = "own_ripple_of_the_gear";

class OwnEffect final : public ClonableEffect<OwnEffect> {
 public:
  OwnEffect(const EffectTarget& target, Eigen::Index joint)
      : ClonableEffect(kOwnEffect, target,
                       {{.name = "ripple", .unit = "deg", .si_per_unit = kPi / 180.0, .typical = 0.5 * kPi / 180.0}}),
        joint_(joint) {}
  void apply(const Instant& at, Corrections& add_to) const override {
    add_to.dq[joint_] += value(0) * std::sin(at.q[joint_]);
  }

 private:
  Eigen::Index joint_;
};

/// Makes it one of the catalogue's, once.
inline void register_own_effect() {
  const auto names = effect_names();
  if (std::find(names.begin(), names.end(), kOwnEffect) != names.end()) return;
  register_effect(
      {.name = kOwnEffect,
       .targets =
           [](const JointRoles& roles) {
             std::vector<EffectTarget> targets;
             for (const auto joint : roles.arm) {
               targets.push_back({roles.names[static_cast<std::size_t>(joint)], ""});
             }
             return targets;
           },
       .make = [](const EffectTarget& target,
                  const JointRoles& roles) { return std::make_unique<OwnEffect>(target, roles.index(target.joint)); },
       .sentence =
           [](const Effect& effect, const JointRoles&, std::span<const std::string> amounts) {
             return "the gear of " + effect.target().joint + " ripples by " + amounts[0] +
                    (effect.parameters()[0].value < 0.0 ? ", backwards" : "");
           },
       .remark = "correct the reading by the ripple"});
}

}  // namespace bodyschema::test
