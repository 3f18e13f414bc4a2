#include <algorithm>
#include <array>
#include <cmath>

#include "bodyschema/diagnosis/trials.hpp"
#include "bodyschema/effects/catalogue.hpp"
#include "trial_random.hpp"

namespace bodyschema {
namespace {

/// Smallest sizes to be found 90 % of the time in a log of 50 s, shoulder to wrist; 0: not
/// visible there.
std::array<double, 7> detectable_by_joint(const std::string& name) {
  if (name == "compliance") return {0.1, 0.1, 0.3, 0.6, 0, 0, 0};
  if (name == "backlash") return {0.1, 0.15, 0.2, 0.2, 0.4, 0.3, 0.3};
  if (name == "encoder_gain") return {0.5, 0.6, 0.8, 0.8, 1.2, 2.0, 2.0};
  if (name == "eccentricity") return {0.3, 0.35, 0.45, 0.45, 0.7, 1.15, 1.15};
  if (name == "joint_coupling") return {0.5, 0.6, 0.7, 0.7, 1.2, 1.8, 1.8};
  if (name == "link_length") return {0, 0, 1.0, 0, 1.0, 0, 0};
  if (name == "axis_tilt") return {0.3, 0.35, 0.4, 0.4, 0.7, 1.0, 1.0};
  if (name == "drift") return {0.2, 0.2, 0.25, 0.25, 0.4, 0.35, 0.35};
  if (name == "slip") return {0.2, 0.2, 0.3, 0.3, 0.8, 0.6, 0.6};
  if (name == "wobble") return {0.2, 0.2, 0.2, 0.2, 0.4, 0.35, 0.35};
  if (name == "velocity_lag") return {10, 10, 12, 12, 25, 20, 20};
  if (name == "acceleration_lag") return {0.2, 0.2, 0.25, 0.25, 0.5, 0.4, 0.4};
  if (name == "local_kink" || name == "random_walk") return {0.3, 0.3, 0.3, 0.3, 0.6, 0.5, 0.5};
  return {};
}

double detectable_of_robot(const std::string& name) {
  if (name == "payload") return 0.25;
  if (name == "latency") return 5.0;
  if (name == "camera_skew") return 5.6;
  if (name == "vergence") return 0.09;
  if (name == "baseline") return 0.4;
  if (name == "focal_length") return 0.55;
  if (name == "principal_point") return 0.4;
  if (name == "distortion") return 0.026;
  if (name == "silhouette_bias") return 0.23;
  if (name == "mesh_scale") return 0.6;
  if (name == "finger_posture") return 0.1;
  return 0.0;
}

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
  diagnosis::TrialRandom random_;
};

/// Many causes of one kind each, none of them large enough to be found.
std::vector<TrialFault> draw_background(Draw& draw, const std::vector<TrialFault>& places) {
  constexpr std::size_t kCauses = 15;
  std::vector<TrialFault> faults;
  while (faults.size() < kCauses) {
    auto fault = draw.fault(places, 0.1, 0.5);
    const bool drawn = std::any_of(faults.begin(), faults.end(), [&](const auto& f) {
      return f.cause.name == fault.cause.name;
    });
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

TrialOptions draw_trial(const TrialRobot& robot, TrialRow row, std::uint64_t seed,
                        std::size_t number) {
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
  const auto joint = [&](std::size_t i) { return roles.names[static_cast<std::size_t>(roles.arm[i])]; };
  std::vector<TrialFault> list;
  const auto by_joint = [&](const std::string& name) {
    const auto sizes = detectable_by_joint(name);
    for (std::size_t i = 0; i < roles.arm.size() && i < sizes.size(); ++i) {
      if (sizes[i] > 0.0) list.push_back({{name, joint(i), ""}, 0.0, 0.0, sizes[i]});
    }
  };
  if (outside_catalogue) {
    for (const char* name : {"wobble", "velocity_lag", "acceleration_lag", "local_kink", "random_walk"}) {
      by_joint(name);
    }
    return list;
  }
  for (const auto& name : effect_names()) {
    if (name == "joint_offset") continue;
    if (name == "joint_coupling") {
      const auto sizes = detectable_by_joint(name);
      for (std::size_t i = 0; i < roles.arm.size() && i < sizes.size(); ++i) {
        if (i > 0) list.push_back({{name, joint(i), joint(i - 1)}, 0.0, 0.0, sizes[i]});
        if (i + 1 < roles.arm.size()) list.push_back({{name, joint(i), joint(i + 1)}, 0.0, 0.0, sizes[i]});
      }
    } else if (name == "head_offset") {
      constexpr std::array<double, 4> kSizes = {0.3, 0.2, 0.3, 0.4};
      const auto targets = effect_targets(name, roles);
      for (std::size_t i = 0; i < targets.size(); ++i) {
        list.push_back({{name, targets[i].joint, ""}, 0.0, 0.0, kSizes[i]});
      }
    } else if (name == "principal_point") {
      for (const char* where : {"difference", "left", "right"}) {
        list.push_back({{name, "", where}, 0.0, 0.0, detectable_of_robot(name)});
      }
    } else if (detectable_of_robot(name) > 0.0) {
      if (!effect_targets(name, roles).empty()) {
        list.push_back({{name, "", ""}, 0.0, 0.0, detectable_of_robot(name)});
      }
    } else {
      by_joint(name);
    }
  }
  return list;
}

}  // namespace bodyschema
