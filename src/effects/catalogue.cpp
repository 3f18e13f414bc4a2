#include "bodyschema/effects/catalogue.hpp"

#include <algorithm>

#include "bodyschema/core/error.hpp"
#include "bodyschema/core/nearest_name.hpp"
#include "factories.hpp"

namespace bodyschema {
namespace {

struct Entry {
  const char* name;
  std::unique_ptr<Effect> (*make)(const EffectTarget&, const JointRoles&);
  effects::Targets (*targets)(const JointRoles&);
};

#define BODYSCHEMA_EFFECT(name)                            \
  Entry {                                                  \
#name, &effects::make_##name, &effects::name##_targets \
  }
constexpr Entry kCatalogue[] = {
    BODYSCHEMA_EFFECT(joint_offset),   BODYSCHEMA_EFFECT(compliance),
    BODYSCHEMA_EFFECT(payload),        BODYSCHEMA_EFFECT(backlash),
    BODYSCHEMA_EFFECT(encoder_gain),   BODYSCHEMA_EFFECT(eccentricity),
    BODYSCHEMA_EFFECT(joint_coupling), BODYSCHEMA_EFFECT(latency),
    BODYSCHEMA_EFFECT(camera_skew),    BODYSCHEMA_EFFECT(link_length),
    BODYSCHEMA_EFFECT(axis_tilt),      BODYSCHEMA_EFFECT(head_offset),
    BODYSCHEMA_EFFECT(vergence),       BODYSCHEMA_EFFECT(baseline),
    BODYSCHEMA_EFFECT(focal_length),   BODYSCHEMA_EFFECT(principal_point),
    BODYSCHEMA_EFFECT(distortion),     BODYSCHEMA_EFFECT(silhouette_bias),
    BODYSCHEMA_EFFECT(mesh_scale),     BODYSCHEMA_EFFECT(finger_posture),
    BODYSCHEMA_EFFECT(drift),          BODYSCHEMA_EFFECT(slip),
    BODYSCHEMA_EFFECT(base_shift),     BODYSCHEMA_EFFECT(axis_shift),
};
#undef BODYSCHEMA_EFFECT

const Entry& entry(const std::string& name) {
  for (const auto& e : kCatalogue) {
    if (name == e.name) return e;
  }
  throw ConfigurationError("unknown effect '" + name + "'; did you mean '" + nearest_name(name, effect_names()) + "'?");
}

using Part = std::string EffectTarget::*;

/// Throws unless some target has this joint or source. Of a coupling joint and source are looked at by
/// themselves: any two joints of the arm may be coupled.
void check_is_listed(const std::string& effect, const char* key, Part part, const EffectTarget& target,
                     const effects::Targets& targets) {
  std::vector<std::string> known;
  for (const auto& t : targets) {
    if (std::find(known.begin(), known.end(), t.*part) == known.end()) known.push_back(t.*part);
  }
  if (std::find(known.begin(), known.end(), target.*part) != known.end()) return;
  std::string expected = known.front().empty() ? "none" : known.front();
  for (std::size_t i = 1; i < known.size(); ++i) expected += (i + 1 < known.size() ? ", " : " or ") + known[i];
  throw ConfigurationError(effect + ": " + key + " is '" + target.*part + "', expected " + expected);
}

}  // namespace

std::string Effect::description() const {
  std::string text = name_;
  if (!target_.joint.empty()) text += " of " + target_.joint;
  if (!target_.source.empty()) text += (target_.joint.empty() ? " " : " with ") + target_.source;
  return text;
}

const std::vector<std::string>& effect_names() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> list;
    for (const auto& e : kCatalogue) list.emplace_back(e.name);
    return list;
  }();
  return names;
}

std::unique_ptr<Effect> make_effect(const std::string& name, const EffectTarget& target, const JointRoles& roles) {
  const auto& e = entry(name);
  const auto targets = e.targets(roles);
  if (targets.empty()) throw ConfigurationError(name + ": this robot lacks the joints for it");
  const bool needs_joint = !targets.front().joint.empty();
  if (needs_joint == target.joint.empty()) {
    throw ConfigurationError(name +
                             (needs_joint ? ": expected a joint" : ": takes no joint, found '" + target.joint + "'"));
  }
  if (needs_joint) static_cast<void>(roles.index(target.joint));  // says which one may be meant
  check_is_listed(name, "joint", &EffectTarget::joint, target, targets);
  check_is_listed(name, "source", &EffectTarget::source, target, targets);
  return e.make(target, roles);
}

std::vector<EffectTarget> effect_targets(const std::string& name, const JointRoles& roles) {
  return entry(name).targets(roles);
}

namespace effects {

Targets arm_targets(const JointRoles& roles) {
  Targets targets;
  for (const auto joint : roles.arm) {
    targets.push_back({roles.names[static_cast<std::size_t>(joint)], ""});
  }
  return targets;
}

}  // namespace effects
}  // namespace bodyschema
