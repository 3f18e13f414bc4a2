#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "bodyschema/effects/effect.hpp"
#include "bodyschema/geometry/pose.hpp"

/// One pair of functions per effect, defined in the file of that name: `make_x` builds it for a
/// target that `x_targets` lists. catalogue.cpp gathers them.
namespace bodyschema::effects {

using Targets = std::vector<EffectTarget>;

inline constexpr double kDeg = kPi / 180.0;

/// Gives an effect its `clone`.
template <class Derived>
class Clonable : public Effect {
 public:
  using Effect::Effect;
  [[nodiscard]] std::unique_ptr<Effect> clone() const override {
    return std::make_unique<Derived>(static_cast<const Derived&>(*this));
  }
};

/// One target per arm joint.
Targets arm_targets(const JointRoles& roles);
/// The whole robot.
inline Targets whole_robot(const JointRoles&) {
  return {EffectTarget{}};
}

#define BODYSCHEMA_EFFECT(name)                                                             \
  std::unique_ptr<Effect> make_##name(const EffectTarget& target, const JointRoles& roles); \
  Targets name##_targets(const JointRoles& roles);

BODYSCHEMA_EFFECT(joint_offset)
BODYSCHEMA_EFFECT(compliance)
BODYSCHEMA_EFFECT(payload)
BODYSCHEMA_EFFECT(backlash)
BODYSCHEMA_EFFECT(encoder_gain)
BODYSCHEMA_EFFECT(eccentricity)
BODYSCHEMA_EFFECT(joint_coupling)
BODYSCHEMA_EFFECT(latency)
BODYSCHEMA_EFFECT(camera_skew)
BODYSCHEMA_EFFECT(link_length)
BODYSCHEMA_EFFECT(base_shift)
BODYSCHEMA_EFFECT(axis_tilt)
BODYSCHEMA_EFFECT(axis_shift)
BODYSCHEMA_EFFECT(head_offset)
BODYSCHEMA_EFFECT(vergence)
BODYSCHEMA_EFFECT(baseline)
BODYSCHEMA_EFFECT(focal_length)
BODYSCHEMA_EFFECT(principal_point)
BODYSCHEMA_EFFECT(distortion)
BODYSCHEMA_EFFECT(silhouette_bias)
BODYSCHEMA_EFFECT(mesh_scale)
BODYSCHEMA_EFFECT(finger_posture)
BODYSCHEMA_EFFECT(drift)
BODYSCHEMA_EFFECT(slip)

#undef BODYSCHEMA_EFFECT

}  // namespace bodyschema::effects
