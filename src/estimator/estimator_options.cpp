#include "bodyschema/estimator/estimator_options.hpp"

namespace bodyschema {

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
  o.silhouette.threads = static_cast<int>(silhouette.integer_or("threads", o.silhouette.threads, 0, 1024));

  const Configuration estimator = configuration.section("estimator");
  const char* mode = o.mode == EstimatorMode::kPaper ? "paper" : "best";
  o.mode =
      estimator.choice_or("mode", mode, {"paper", "best"}) == "paper" ? EstimatorMode::kPaper : EstimatorMode::kBest;
  o.min_mask_px = static_cast<std::size_t>(
      estimator.integer_or("min_mask_px", static_cast<std::int64_t>(o.min_mask_px), 1, 1000000000));
  const Configuration best = estimator.section("best");
  o.temperature = best.number_or("temperature", o.temperature, 1e-6, 10.0);
  o.refine_outline = best.boolean_or("refine_outline", o.refine_outline);
  o.contour.spacing_px =
      static_cast<float>(best.number_or("contour_spacing_px", static_cast<double>(o.contour.spacing_px), 0.5, 100.0));
  o.contour.huber_px = best.number_or("huber_px", o.contour.huber_px, 1e-3, 100.0);
  o.residual_sd_px = best.number_or("residual_sd_px", o.residual_sd_px, 1e-3, 100.0);
  o.encoder_sd_rad = radians(best.number_or("encoder_sd_deg", degrees(o.encoder_sd_rad), 1e-6, 10.0));
  o.correlated_frames = best.number_or("correlated_frames", o.correlated_frames, 1.0, 1e6);
  o.memory_frames = best.number_or("memory_frames", o.memory_frames, 1.0, 1e9);
  o.lock_distance = best.number_or("lock_distance", o.lock_distance, 0.0, 1.0);
  o.lock_rms_px = best.number_or("lock_rms_px", o.lock_rms_px, 0.0, 1e3);
  o.converged_hand_sd_m = 1e-3 * best.number_or("converged_hand_sd_mm", 1e3 * o.converged_hand_sd_m, 1e-6, 1e3);
  const Configuration priors = best.section("prior_sd");
  auto& p = o.priors;
  p.head_rad = radians(priors.number_or("head_deg", degrees(p.head_rad), 0.0, 90.0));
  p.finger_curl_rad = radians(priors.number_or("finger_curl_deg", degrees(p.finger_curl_rad), 0.0, 90.0));
  p.vergence_rad = radians(priors.number_or("vergence_deg", degrees(p.vergence_rad), 0.0, 90.0));
  p.focal_scale = 0.01 * priors.number_or("focal_scale_percent", 100.0 * p.focal_scale, 0.0, 50.0);
  p.principal_difference_px = priors.number_or("principal_difference_px", p.principal_difference_px, 0.0, 100.0);
  p.mesh_scale = 0.01 * priors.number_or("mesh_scale_percent", 100.0 * p.mesh_scale, 0.0, 50.0);
  p.dilation_px = priors.number_or("dilation_px", p.dilation_px, 0.0, 20.0);
  return o;
}

}  // namespace bodyschema
