#include "bodyschema/estimator/estimator_options.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "bodyschema/camera/lens_knowledge.hpp"
#include "bodyschema/camera/shutter.hpp"

namespace bodyschema {
namespace {

/// Of a number that need not be chosen.
bool is_auto(const Configuration& section, const std::string& key) {
  return section.text_or(key, "auto") == "auto";
}

}  // namespace

EstimatorOptions EstimatorOptions::from(const Configuration& configuration) {
  EstimatorOptions o;
  const Configuration filter = configuration.section("filter");
  auto& f = o.filter;
  f.particles =
      static_cast<std::size_t>(filter.integer_or("particles", static_cast<std::int64_t>(f.particles), 1, 1000000));
  f.initial_sd_rad = radians(filter.number_or("initial_sd_deg", degrees(f.initial_sd_rad), 1e-6, 90.0));
  f.spread_rad = radians(filter.number_or("spread_deg", degrees(f.spread_rad), 0.0, 90.0));
  f.spread_decay = filter.number_or("spread_decay", f.spread_decay, 0.0, 1.0);
  f.spread_min_rad = radians(filter.number_or("spread_min_deg", degrees(f.spread_min_rad), 0.0, 90.0));
  f.kde_sd_deg = filter.number_or("kde_sd_deg", f.kde_sd_deg, 1e-3, 90.0);
  f.kde_alpha = filter.number_or("kde_alpha", f.kde_alpha, 0.0, 1e9);
  f.seed = static_cast<std::uint64_t>(filter.integer_or("seed", static_cast<std::int64_t>(f.seed), 0, INT64_MAX));

  const Configuration silhouette = configuration.section("silhouette");
  o.silhouette.engine = silhouette.choice_or("engine", o.silhouette.engine, {"auto", "atlas", "contour"});
  o.silhouette.gl_platform = silhouette.choice_or("gl_platform", o.silhouette.gl_platform,
                                                  {"auto", "egl_device", "egl_surfaceless", "osmesa"});
  o.silhouette.gl_pass = silhouette.choice_or("gl_pass", o.silhouette.gl_pass, {"auto", "raster", "compute"});
  o.silhouette.threads = static_cast<int>(silhouette.integer_or("threads", o.silhouette.threads, 0, 1024));

  const Configuration estimator = configuration.section("estimator");
  const char* mode = o.mode == EstimatorMode::kPaper ? "paper" : "best";
  o.mode =
      estimator.choice_or("mode", mode, {"paper", "best"}) == "paper" ? EstimatorMode::kPaper : EstimatorMode::kBest;
  o.min_mask_share = 0.01 * estimator.number_or("min_mask_percent", 100.0 * o.min_mask_share, 1e-4, 100.0);
  const Configuration best = estimator.section("best");
  o.temperature = best.number_or("temperature", o.temperature, 1e-6, 10.0);
  o.refine_outline = best.boolean_or("refine_outline", o.refine_outline);
  o.remember = best.boolean_or("remember", o.remember);
  o.live_diagnosis = best.boolean_or("live_diagnosis", o.live_diagnosis);
  o.search_renders =
      is_auto(best, "search_renders") ? 0 : static_cast<int>(best.integer("search_renders", 1, 1'000'000));
  o.outline_spacing_px = best.number_or("outline_spacing_px", o.outline_spacing_px, 0.5, 100.0);
  o.noise.sd_px = best.number_or("outline_sd_px", o.noise.sd_px, 1e-3, 100.0);
  o.noise.floor_px = best.number_or("outline_floor_px", o.noise.floor_px, 0.0, 100.0);
  o.noise.correlated_points = best.number_or("outline_points_alike", o.noise.correlated_points, 1.0, 1e4);
  auto& m = o.memory;
  m.encoder_sd_rad = radians(best.number_or("encoder_sd_deg", degrees(m.encoder_sd_rad), 1e-6, 10.0));
  m.posture_sd_rad = radians(best.number_or("posture_sd_deg", degrees(m.posture_sd_rad), 1e-6, 10.0));
  o.stamp_sd_s = 1e-3 * best.number_or("stamp_sd_ms", 1e3 * o.stamp_sd_s, 1e-3, 1e3);
  m.memory_s = best.number_or("memory_s", m.memory_s, 0.1, 1e9);
  m.block_s = best.number_or("posture_s", m.block_s, 1e-3, 1e3);
  m.same_posture_rad = radians(best.number_or("same_posture_deg", degrees(m.same_posture_rad), 0.0, 90.0));
  m.most_blocks =
      static_cast<std::size_t>(best.integer_or("most_postures", static_cast<std::int64_t>(m.most_blocks), 4, 10000));
  o.least_postures =
      static_cast<std::size_t>(best.integer_or("least_postures", static_cast<std::int64_t>(o.least_postures), 1, 1000));
  o.converged_hand_sd_m =
      is_auto(best, "converged_hand_sd_mm") ? 0.0 : 1e-3 * best.number("converged_hand_sd_mm", 1e-6, 1e3);
  return o;
}

std::vector<Belief> camera_beliefs(const StereoRig& rig) {
  // Physical: where nothing is known the camera is first searched for; the search leaves no more than this.
  constexpr double kSearched_m = 0.3, kSearched_rad = 0.3;
  const auto sds = [&](const CameraMount& mount) {
    const bool unknown = mount.knowledge == PlaceKnowledge::kUnknown;
    const Eigen::Vector3d m = unknown ? Eigen::Vector3d::Constant(kSearched_m) : mount.sd_m;
    const Eigen::Vector3d rad = unknown ? Eigen::Vector3d::Constant(kSearched_rad) : mount.sd_rad;
    return std::vector<double>{m.x(), m.y(), m.z(), rad.x(), rad.y(), rad.z()};
  };
  std::vector<Belief> list;
  if (rig.cameras.empty()) return list;
  const auto& first = rig.cameras.front().mount;
  if (first.knowledge != PlaceKnowledge::kExact) list.push_back({"camera_pose", {}, sds(first)});
  if (rig.cameras.size() < 2) return list;
  const auto& second = rig.cameras[1].mount;
  std::vector<double> pair(6, 0.0);
  if (second.knowledge != PlaceKnowledge::kExact) pair = sds(second);
  if (!second.relative && first.knowledge != PlaceKnowledge::kExact) {
    // The pair's axes are the second camera's; the first may look anywhere, so that its widest counts along each.
    auto own = sds(first);
    std::fill_n(own.begin(), 3, *std::max_element(own.begin(), own.begin() + 3));
    std::fill_n(own.begin() + 3, 3, *std::max_element(own.begin() + 3, own.end()));
    for (std::size_t k = 0; k < pair.size(); ++k) pair[k] = std::hypot(pair[k], own[k]);
  }
  if (pair[0] > 0.0) list.push_back({"camera_pair", {}, pair});
  return list;
}

namespace {

/// Of what a lens does beyond its configuration; where cameras differ, of the one that is known least. Nothing where
/// the configuration says what to believe.
std::optional<Belief> lens_belief(const Configuration& configuration, const StereoRig& rig) {
  if (configuration.section("estimator").section("state").has("distortion")) return std::nullopt;
  double sd = 0.0;
  for (const auto& camera : rig.cameras) {
    sd = std::max(sd, lens_sd(lens_knowledge(configuration.section("cameras").section(camera.name))));
  }
  if (sd == 0.0) return std::nullopt;
  return Belief{"distortion", {}, {sd}};
}

/// Whether the configuration says how long the pictures of every camera are read out.
bool shutters_known(const Configuration& cameras, const StereoRig& rig) {
  return std::all_of(rig.cameras.begin(), rig.cameras.end(),
                     [&](const CameraModel& camera) { return readout_s(cameras.section(camera.name)).has_value(); });
}

}  // namespace

Beliefs Beliefs::from(const Configuration& configuration, const JointRoles& roles, const StereoRig& rig,
                      const EstimatorOptions& options) {
  Beliefs beliefs;
  beliefs.state = read_beliefs(configuration.section("estimator").section("state"), roles);
  for (auto& belief : camera_beliefs(rig)) {
    std::erase_if(beliefs.state,
                  [&](const Belief& b) { return b.effect == belief.effect && b.target == belief.target; });
    beliefs.state.push_back(std::move(belief));
  }
  if (auto lens = lens_belief(configuration, rig)) beliefs.state.push_back(std::move(*lens));
  if (shutters_known(configuration.section("cameras"), rig)) {
    std::erase_if(beliefs.state, [](const Belief& b) { return b.effect == "rolling_shutter"; });
  }
  beliefs.tolerances = read_beliefs(configuration.section("robot").section("tolerances"), roles);
  for (const char* section : {"estimator", "robot"}) {
    const char* key = section == std::string("robot") ? "tolerances" : "state";
    if (configuration.section(section).section(key).has("joint_offset")) {
      configuration.section(section).section(key).fail(
          "joint_offset", "it nowhere here: what is believed of offsets is filter.initial_sd_deg");
    }
  }
  std::vector<Belief> offsets;
  for (const auto& target : effect_targets("joint_offset", roles)) {
    offsets.push_back({"joint_offset", target, {options.filter.initial_sd_rad}});
  }
  if (options.mode == EstimatorMode::kPaper) beliefs.state.clear();
  beliefs.state.insert(beliefs.state.begin(), offsets.begin(), offsets.end());
  // What is estimated is believed to be as far off as both say.
  std::erase_if(beliefs.tolerances, [&](const Belief& t) {
    const auto same = std::find_if(beliefs.state.begin(), beliefs.state.end(),
                                   [&](const Belief& b) { return b.effect == t.effect && b.target == t.target; });
    if (same == beliefs.state.end()) return false;
    for (std::size_t i = 0; i < same->sd.size(); ++i) same->sd[i] = std::hypot(same->sd[i], t.sd[i]);
    return true;
  });
  return beliefs;
}

}  // namespace bodyschema
