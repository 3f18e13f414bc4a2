#pragma once

#include <cmath>
#include <memory>
#include <span>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "bodyschema/effects/effect_kind.hpp"
#include "bodyschema/geometry/pose.hpp"

/// What the files of the catalogue share. Each defines one function, named as its effect, that returns its kind;
/// CMakeLists.txt lists them, and catalogue.cpp gathers them from there.
namespace bodyschema::effects {

using Targets = std::vector<EffectTarget>;
using Parameters = std::span<const EffectParameter>;

inline constexpr double kDeg = kPi / 180.0;

inline EffectParameter in_degrees(const char* name, double typical_deg) {
  return {.name = name, .unit = "deg", .si_per_unit = kDeg, .typical = typical_deg * kDeg};
}
inline EffectParameter in_mm(const char* name, double typical_mm) {
  return {.name = name, .unit = "mm", .si_per_unit = 1e-3, .typical = 1e-3 * typical_mm};
}
inline EffectParameter in_percent(const char* name, double typical_percent) {
  return {.name = name, .unit = "%", .si_per_unit = 0.01, .typical = 0.01 * typical_percent};
}
inline EffectParameter in_ms(const char* name, double typical_ms) {
  return {.name = name, .unit = "ms", .si_per_unit = 1e-3, .typical = 1e-3 * typical_ms};
}
inline EffectParameter in_px(const char* name, double typical_px) {
  return {.name = name, .unit = "px", .si_per_unit = 1.0, .typical = typical_px};
}

/// What an effect without memory looks at.
enum class Follows { kPosture, kMotion, kGravity };

/// An effect without memory: what it adds is a function of its parameters and the instant.
template <class Apply>
class PlainEffect final : public ClonableEffect<PlainEffect<Apply>> {
 public:
  PlainEffect(std::string name, EffectTarget target, std::vector<EffectParameter> parameters, Follows follows,
              Apply apply)
      : ClonableEffect<PlainEffect<Apply>>(std::move(name), std::move(target), std::move(parameters)),
        follows_(follows), apply_(std::move(apply)) {}
  void apply(const Instant& at, Corrections& add_to) const override { apply_(this->parameters(), at, add_to); }
  [[nodiscard]] bool follows_motion() const override { return follows_ == Follows::kMotion; }
  [[nodiscard]] bool follows_gravity() const override { return follows_ == Follows::kGravity; }

 private:
  Follows follows_;
  Apply apply_;
};

/// @param apply  void(Parameters, const Instant&, Corrections& add_to)
template <class Apply>
std::unique_ptr<Effect> plain(std::string name, const EffectTarget& target, std::vector<EffectParameter> parameters,
                              Apply apply, Follows follows = Follows::kPosture) {
  return std::make_unique<PlainEffect<Apply>>(std::move(name), target, std::move(parameters), follows,
                                              std::move(apply));
}

/// EffectKind::make of an effect without memory that is the same on every target.
template <class Apply>
auto everywhere(const char* name, std::vector<EffectParameter> parameters, Apply apply,
                Follows follows = Follows::kPosture) {
  return [=](const EffectTarget& target, const JointRoles&) { return plain(name, target, parameters, apply, follows); };
}
/// ... of one that acts on its target's joint.
/// @param apply  void(Eigen::Index joint, Parameters, const Instant&, Corrections& add_to)
template <class Apply>
auto on_joint(const char* name, std::vector<EffectParameter> parameters, Apply apply,
              Follows follows = Follows::kPosture) {
  return [=](const EffectTarget& target, const JointRoles& roles) {
    const auto add = [apply, joint = roles.index(target.joint)](Parameters p, const Instant& at, Corrections& c) {
      apply(joint, p, at, c);
    };
    return plain(name, target, parameters, add, follows);
  };
}

/// The whole robot.
inline Targets whole_robot(const JointRoles&) {
  return {EffectTarget{}};
}
/// What is between two cameras.
inline Targets camera_pair_targets(const JointRoles& roles) {
  return roles.cameras.size() > 1 ? whole_robot(roles) : Targets{};
}
inline Targets joint_targets(const JointRoles& roles, const std::vector<Eigen::Index>& joints) {
  Targets targets;
  for (const auto joint : joints) targets.push_back({roles.names[static_cast<std::size_t>(joint)], ""});
  return targets;
}
/// One target per arm joint.
inline Targets arm_targets(const JointRoles& roles) {
  return joint_targets(roles, roles.arm);
}
/// Each segment of the body by name, where there are several.
Targets segment_targets(const JointRoles& roles);
/// The whole body, then those.
Targets body_targets(const JointRoles& roles);
/// Positions in Corrections::shapes that a target of these means.
std::vector<std::size_t> segments_of(const EffectTarget& target, const JointRoles& roles);

/// "more" or "less", "longer" or "shorter", ... by the sign of a parameter.
inline std::string by_sign(const EffectParameter& p, const char* positive, const char* negative) {
  return p.value < 0.0 ? negative : positive;
}
/// "3.1 deg": a number of two decimals at the most, for reasons.
std::string short_number(double value, int decimals = 1);

/// "1.2 mm (1.1 to 1.3) lower, and looks 0.7 deg (0.6 to 0.8) further up": how a camera's place departs, by its own
/// axes (x right, y down, z forward), from three shifts and three turns about them. Amounts whose intervals hold zero
/// ("at most") are left out, unless all do.
std::string camera_place(Parameters shifts_and_turns, std::span<const std::string> amounts);

/// Reasons that several effects share (EffectKind::not_testable); empty: testable.
std::string joint_hardly_moved(const EffectTarget& target, const JointRoles& roles, const LogMotion& motion);
std::string too_slow(const EffectTarget&, const JointRoles&, const LogMotion& motion);
std::string needs_two_cameras(const EffectTarget&, const JointRoles&, const LogMotion& motion);
/// A log of single postures cannot tell what changed in the course of it.
std::string needs_motion_that_was_seen(const EffectTarget&, const JointRoles&, const LogMotion& motion);

}  // namespace bodyschema::effects
