#include <algorithm>
#include <deque>

#include "bodyschema/core/error.hpp"
#include "bodyschema/core/nearest_name.hpp"
#include "kinds.hpp"

namespace bodyschema {
namespace effects {

#define BODYSCHEMA_EFFECT(name) EffectKind name();
#include "effect_list.inc"
#undef BODYSCHEMA_EFFECT

std::string camera_place(Parameters p, std::span<const std::string> amounts) {
  const char* const ways[][2] = {{"further right", "further left"},   {"lower", "higher"},
                                 {"further forward", "further back"}, {"further up", "further down"},
                                 {"further right", "further left"},   {"clockwise", "anticlockwise"}};
  std::vector<std::string> moves, turns;
  const bool told =
      std::any_of(amounts.begin(), amounts.end(), [](const auto& a) { return a.find("at most") == std::string::npos; });
  for (std::size_t i = 0; i < amounts.size(); ++i) {
    if (told && amounts[i].find("at most") != std::string::npos) continue;
    const auto by = amounts[i] + " " + by_sign(p[i], ways[i][0], ways[i][1]);
    if (i < 3)
      moves.push_back(by);
    else
      turns.push_back((i == 5 ? "rolled by " : "looking ") + by);
  }
  std::string text;
  for (const auto* list : {&moves, &turns}) {
    for (const auto& part : *list) text += (text.empty() ? "" : ", ") + part;
  }
  return text;
}

Targets segment_targets(const JointRoles& roles) {
  Targets targets;
  if (roles.segments.size() < 2) return targets;
  for (const auto& segment : roles.segments) targets.push_back({"", segment.name});
  return targets;
}

Targets body_targets(const JointRoles& roles) {
  Targets targets = segment_targets(roles);
  targets.insert(targets.begin(), EffectTarget{});
  return targets;
}

std::vector<std::size_t> segments_of(const EffectTarget& target, const JointRoles& roles) {
  std::vector<std::size_t> list;
  for (std::size_t s = 0; s < roles.segments.size(); ++s) {
    if (target.source.empty() || roles.segments[s].name == target.source) list.push_back(s);
  }
  return list;
}

std::string short_number(double value, int decimals) {
  std::ostringstream text;
  text.setf(std::ios::fixed);
  text.precision(decimals);
  text << value;
  return text.str();
}

std::string joint_hardly_moved(const EffectTarget& target, const JointRoles& roles, const LogMotion& motion) {
  constexpr double kLeastRange = 5.0 * kDeg;
  const double range = motion.range_rad[roles.index(target.joint)];
  return range < kLeastRange ? target.joint + " moved " + short_number(range / kDeg) + " deg" : "";
}

std::string too_slow(const EffectTarget&, const JointRoles&, const LogMotion& motion) {
  constexpr double kLeastSpeed = 3.0 * kDeg;  // rad/s
  return motion.arm_speed_rad_s < kLeastSpeed
             ? "the arm moved at " + short_number(motion.arm_speed_rad_s / kDeg) + " deg/s"
             : "";
}

std::string needs_two_cameras(const EffectTarget&, const JointRoles&, const LogMotion& motion) {
  return motion.cameras < 2 ? "the log has one camera" : "";
}

namespace {

/// References to entries hold when more are registered.
std::deque<EffectKind>& catalogue() {
  static std::deque<EffectKind> kinds = [] {
    std::deque<EffectKind> list;
#define BODYSCHEMA_EFFECT(name) list.push_back(name());
#include "effect_list.inc"
#undef BODYSCHEMA_EFFECT
    return list;
  }();
  return kinds;
}

using Part = std::string EffectTarget::*;

/// Throws unless some target has this joint or source. Of a coupling joint and source are looked at by
/// themselves: any two joints of the arm may be coupled.
void check_is_listed(const std::string& effect, const char* key, Part part, const EffectTarget& target,
                     const Targets& targets) {
  std::vector<std::string> known;
  for (const auto& t : targets) {
    if (std::find(known.begin(), known.end(), t.*part) == known.end()) known.push_back(t.*part);
  }
  if (std::find(known.begin(), known.end(), target.*part) != known.end()) return;
  std::erase(known, "");
  std::string expected = known.empty() ? "none" : known.front();
  for (std::size_t i = 1; i < known.size(); ++i) expected += (i + 1 < known.size() ? ", " : " or ") + known[i];
  throw ConfigurationError(effect + ": " + key + " is '" + target.*part + "', expected " + expected);
}

}  // namespace
}  // namespace effects

std::string EffectParameter::key() const {
  if (unit == "1") return name;
  std::string suffix = unit == "%" ? "percent" : unit;
  if (const auto slash = suffix.find('/'); slash != std::string::npos) suffix.replace(slash, 1, "_per_");
  return name + "_" + suffix;
}

std::string Effect::description() const {
  std::string text = name_;
  if (!target_.joint.empty()) text += " of " + target_.joint;
  if (!target_.source.empty()) text += (target_.joint.empty() ? " " : " with ") + target_.source;
  return text;
}

std::vector<std::reference_wrapper<const EffectKind>> effect_kinds() {
  const auto& kinds = effects::catalogue();
  return {kinds.begin(), kinds.end()};
}

void register_effect(EffectKind kind) {
  for (const auto& known : effects::catalogue()) {
    if (known.name == kind.name) throw ConfigurationError("effect '" + kind.name + "' is in the catalogue already");
  }
  effects::catalogue().push_back(std::move(kind));
}

std::vector<std::string> effect_names() {
  std::vector<std::string> names;
  for (const auto& kind : effects::catalogue()) names.push_back(kind.name);
  return names;
}

const EffectKind& effect_kind(const std::string& name) {
  for (const auto& kind : effects::catalogue()) {
    if (kind.name == name) return kind;
  }
  throw ConfigurationError("unknown effect '" + name + "'; did you mean '" + nearest_name(name, effect_names()) + "'?");
}

std::unique_ptr<Effect> make_effect(const std::string& name, const EffectTarget& target, const JointRoles& roles) {
  const auto& kind = effect_kind(name);
  const auto targets = kind.targets(roles);
  if (targets.empty()) throw ConfigurationError(name + ": this robot lacks what it needs");
  const bool needs_joint = !targets.front().joint.empty();
  if (needs_joint == target.joint.empty()) {
    throw ConfigurationError(name +
                             (needs_joint ? ": expected a joint" : ": takes no joint, found '" + target.joint + "'"));
  }
  if (needs_joint) static_cast<void>(roles.index(target.joint));  // says which one may be meant
  effects::check_is_listed(name, "joint", &EffectTarget::joint, target, targets);
  effects::check_is_listed(name, "source", &EffectTarget::source, target, targets);
  return kind.make(target, roles);
}

std::vector<EffectTarget> effect_targets(const std::string& name, const JointRoles& roles) {
  return effect_kind(name).targets(roles);
}

}  // namespace bodyschema
