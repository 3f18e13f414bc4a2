#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "bodyschema/core/seeded_random.hpp"
#include "bodyschema/diagnosis/detectable.hpp"
#include "bodyschema/diagnosis_trials/trials.hpp"
#include "bodyschema/effects/catalogue.hpp"

namespace bodyschema {
namespace {

bool one_sided(const std::string& name) {
  return name == "compliance" || name == "payload" || name == "backlash" || name == "wobble" ||
         name == "velocity_lag" || name == "acceleration_lag" || name == "random_walk";
}

class Draw {
 public:
  explicit Draw(std::uint64_t seed) : random_(seed) {}

  /// Every kind of cause equally often, then any of its places.
  TrialFault fault(const std::vector<TrialFault>& places, double low, double high) {
    std::vector<std::string> names;
    for (const auto& p : places) {
      if (std::find(names.begin(), names.end(), p.cause.name) == names.end()) {
        names.push_back(p.cause.name);
      }
    }
    const auto name = names[random_.below(names.size())];
    std::vector<TrialFault> of_kind;
    for (const auto& p : places) {
      if (p.cause.name == name) of_kind.push_back(p);
    }
    return sized(of_kind[random_.below(of_kind.size())], low, high);
  }

  TrialFault sized(TrialFault fault, double low, double high) {
    const auto& name = fault.cause.name;
    const double sign = one_sided(name) || random_.uniform(0, 1) < 0.5 ? 1.0 : -1.0;
    fault.value = sign * fault.detectable * random_.uniform(low, high);
    if (name == "slip") fault.second = random_.uniform(0.1, 0.9);
    if (name == "wobble") fault.second = std::exp(random_.uniform(std::log(4.0), std::log(15.0)));
    if (name == "axis_tilt" && random_.uniform(0, 1) < 0.5) std::swap(fault.value, fault.second);
    if (name == "principal_point" && random_.uniform(0, 1) < 0.5) std::swap(fault.value, fault.second);
    return fault;
  }

 private:
  SeededRandom random_;
};

/// Many causes of one kind each, none of them large enough to be found.
std::vector<TrialFault> draw_background(Draw& draw, const std::vector<TrialFault>& places) {
  constexpr std::size_t kCauses = 15;
  std::vector<TrialFault> faults;
  while (faults.size() < kCauses) {
    auto fault = draw.fault(places, 0.1, 0.5);
    const bool drawn =
        std::any_of(faults.begin(), faults.end(), [&](const auto& f) { return f.cause.name == fault.cause.name; });
    if (!drawn) faults.push_back(std::move(fault));
  }
  return faults;
}

/// Two causes of different kinds.
std::vector<TrialFault> draw_two(Draw& draw, const std::vector<TrialFault>& places) {
  std::vector<TrialFault> faults = {draw.fault(places, 3.0, 6.0)};
  while (faults.size() < 2) {
    auto second = draw.fault(places, 3.0, 6.0);
    if (second.cause.name != faults.front().cause.name) faults.push_back(std::move(second));
  }
  return faults;
}

TrialFault draw_outside(Draw& draw, const std::vector<TrialFault>& places, bool hard) {
  std::vector<TrialFault> kept;
  for (const auto& place : places) {
    const bool is_hard = place.cause.name == "local_kink" || place.cause.name == "random_walk";
    if (is_hard == hard) kept.push_back(place);
  }
  return draw.fault(kept, 3.0, 6.0);
}

}  // namespace

TrialOptions draw_trial(const TrialRobot& robot, TrialRow row, std::uint64_t seed, std::size_t number) {
  Draw draw(seed);
  const auto inside = trial_faults(robot, false), outside = trial_faults(robot, true);
  TrialOptions options;
  switch (row) {
    case TrialRow::kNull: options.noise_burst = number % 2 == 1; break;
    case TrialRow::kBackground: options.faults = draw_background(draw, inside); break;
    case TrialRow::kSingle: options.faults = {draw.fault(inside, 3.0, 6.0)}; break;
    case TrialRow::kLimit: options.faults = {draw.fault(inside, 1.0, 1.0)}; break;
    case TrialRow::kTwo: options.faults = draw_two(draw, inside); break;
    case TrialRow::kOutside: options.faults = {draw_outside(draw, outside, false)}; break;
    case TrialRow::kOutsideHard: options.faults = {draw_outside(draw, outside, true)}; break;
  }
  return options;
}

std::vector<TrialFault> trial_faults(const TrialRobot& robot, bool outside_catalogue) {
  const auto roles = JointRoles::of(robot.model, robot.setup, robot.rig);
  std::vector<TrialFault> list;
  const auto add = [&](const std::string& name, const EffectTarget& target) {
    const double size = detectable_size(name, target, roles);
    if (size > 0.0) list.push_back({{name, target.joint, target.source}, 0.0, 0.0, size});
  };
  if (outside_catalogue) {
    for (const char* name : {"wobble", "velocity_lag", "acceleration_lag", "local_kink", "random_walk"}) {
      for (const auto joint : roles.arm) add(name, {roles.names[static_cast<std::size_t>(joint)], ""});
    }
    return list;
  }
  const auto place_in_arm = [&](const std::string& joint) {
    return std::find(roles.arm.begin(), roles.arm.end(), roles.index(joint)) - roles.arm.begin();
  };
  for (const auto& name : effect_names()) {
    for (const auto& target : effect_targets(name, roles)) {
      // Couplings of neighbours; shifts of the picture that are no matter of neck and eyes.
      if (name == "joint_coupling" && std::abs(place_in_arm(target.joint) - place_in_arm(target.source)) > 1) continue;
      if (name == "principal_point" && target.source == "common") continue;
      add(name, target);
    }
  }
  return list;
}

}  // namespace bodyschema
