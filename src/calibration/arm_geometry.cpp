#include "arm_geometry.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "bodyschema/evidence/variance_components.hpp"

namespace bodyschema {
namespace {

/// Physical. Arms that come with a URDF are built to less as often as not.
constexpr double kBeside_m = 0.5e-3, kTilted_rad = radians(0.1);
/// Statistical. Less than such odds is not worth more than a bare mention (Kass and Raftery, 1995).
constexpr double kOdds = 3.0;
constexpr std::size_t kBeside = 0, kTilted = 1;

struct Kind {
  const char* effect;
  std::size_t component;
  double unit;
};
constexpr std::array kKinds = {Kind{"joint_place", kBeside, kBeside_m}, Kind{"axis_tilt", kTilted, kTilted_rad}};

const Kind& kind_of(const std::string& effect) {
  return *std::find_if(kKinds.begin(), kKinds.end(), [&](const Kind& k) { return effect == k.effect; });
}

template <class Named>
bool holds(const std::vector<Belief>& list, const Named& effect, const EffectTarget& target) {
  return std::any_of(list.begin(), list.end(),
                     [&](const Belief& b) { return b.effect == effect && b.target == target; });
}

}  // namespace

ArmGeometry::ArmGeometry(const JointRoles& roles, const State& state, const std::vector<Belief>& tolerances) {
  for (const auto& kind : kKinds) {
    for (const auto& target : effect_targets(kind.effect, roles)) {
      if (holds(tolerances, kind.effect, target) || state.model().find(kind.effect, target) != nullptr) {
        of_every_joint_ = false;
        continue;
      }
      const auto parameters = make_effect(kind.effect, target, roles)->parameters().size();
      probe_.push_back({kind.effect, target, std::vector<double>(parameters, kind.unit)});
    }
  }
}

ArmGeometry::Found ArmGeometry::measure(const BatchFit& batch) const {
  const auto& considered = batch.beside().effects;
  const auto parameters = fitted_parameters(considered);
  std::array<VarianceComponent, 2> components;
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const auto& effect = considered[parameters[i].effect];
    if (!holds(probe_, effect.name(), effect.target())) continue;
    components[kind_of(effect.name()).component].push_back(static_cast<Eigen::Index>(i));
  }
  const auto measured = measure_components(batch.memory().of_considered(), components);
  Found found;
  found.beside_sd_m = measured.sd[kBeside] * kBeside_m;
  found.tilted_sd_rad = measured.sd[kTilted] * kTilted_rad;
  found.asked_for = measured.log_odds > std::log(kOdds);
  for (Belief belief : probe_) {
    for (double& sd : belief.sd) sd *= measured.sd[static_cast<Eigen::Index>(kind_of(belief.effect).component)];
    found.beliefs.push_back(std::move(belief));
  }
  spdlog::debug("arm geometry: joints {:.2f} mm beside, axes tilted by {:.2f} deg, log odds {:.1f}",
                1e3 * found.beside_sd_m, degrees(found.tilted_sd_rad), measured.log_odds);
  return found;
}

}  // namespace bodyschema
