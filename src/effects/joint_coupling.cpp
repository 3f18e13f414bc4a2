#include <cstdlib>

#include "bodyschema/core/error.hpp"
#include "kinds.hpp"

namespace bodyschema::effects {
namespace {

/// Tendons are routed past the next joint or the one after it.
constexpr int kReach = 2;

Targets neighbours(const JointRoles& roles) {
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

}  // namespace

/// Tendons of one joint run past another: dq_joint = ratio * q_source.
EffectKind joint_coupling() {
  return {
      .name = "joint_coupling",
      .targets = neighbours,
      .make =
          [](const EffectTarget& target, const JointRoles& roles) {
            if (target.joint == target.source) {
              throw ConfigurationError("joint_coupling of '" + target.joint + "': expected another joint as source");
            }
            return plain(
                "joint_coupling", target, {in_percent("ratio", 2.0)},
                [joint = roles.index(target.joint), source = roles.index(target.source)](
                    Parameters p, const Instant& at, Corrections& c) { c.dq[joint] += p[0].value * at.q[source]; });
          },
      .sentence =
          [](const Effect& e, const JointRoles&, std::span<const std::string> amounts) {
            return e.target().joint + " turns by " + amounts[0] + " of the angle of " + e.target().source +
                   by_sign(e.parameters()[0], "", ", the other way");
          },
      .not_testable =
          [](const EffectTarget& target, const JointRoles& roles, const LogMotion& motion) {
            const auto source = joint_hardly_moved({target.source, ""}, roles, motion);
            return source.empty() ? joint_hardly_moved(target, roles, motion) : source;
          },
      .lookalikes = {"axis_tilt"},
      .splitting_motion = "Move the joint and its neighbours one at a time through their full ranges.",
      .remark = "correct the coupling matrix where encoders are read"};
}

}  // namespace bodyschema::effects
