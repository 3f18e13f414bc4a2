#pragma once

#include <cstdint>
#include <string>

#include "bodyschema/core/configuration.hpp"
#include "bodyschema/estimator/contour_alignment.hpp"
#include "bodyschema/filter/particle_filter.hpp"
#include "bodyschema/geometry/pose.hpp"
#include "bodyschema/silhouette/silhouette_scorer.hpp"

namespace bodyschema {

enum class EstimatorMode {
  kPaper,  ///< the paper's filter, literally
  kBest,   ///< sharper likelihood, outline refinement, fusion over frames
};

/// Standard deviations of what `best` believes before the first picture, beside the joint offsets.
/// Zero leaves a parameter out.
struct NuisancePriors {
  double head_rad = 0.0;
  double finger_curl_rad = 0.0;
  double vergence_rad = 0.0;
  double focal_scale = 0.0;
  double principal_difference_px = 0.0;
  double mesh_scale = 0.0;
  double dilation_px = 0.0;
};

/// Everything that config/estimator.yaml sets, with the values it has there.
struct EstimatorOptions {
  EstimatorMode mode = EstimatorMode::kBest;
  ParticleFilterOptions filter;
  SilhouetteOptions silhouette;
  ContourAlignmentOptions contour;
  NuisancePriors priors = {.head_rad = radians(3.0),
                           .finger_curl_rad = radians(1.5),
                           .focal_scale = 0.002,
                           .principal_difference_px = 0.4,
                           .mesh_scale = 0.0035,
                           .dilation_px = 0.15};
  double temperature = 0.02;               ///< best: weight = exp(-(d - d_min) / temperature)
  bool refine_outline = true;              ///< best: without it the estimate is one of the particles
  double residual_sd_px = 0.5;             ///< best: sd of one outline residual, correlation included
  double encoder_sd_rad = radians(0.035);  ///< best: one encoder reading's noise and rounding
  double correlated_frames = 6.0;          ///< best: neighbouring frames that err alike count as one
  double memory_frames = 300.0;            ///< best: frames after which a picture counts 1/e
  double lock_distance = 0.15;             ///< best: Hammoude distance below which frames are fused
  double lock_rms_px = 1.5;                ///< best: outline residual below which frames are fused
  double converged_hand_sd_m = 1e-3;       ///< best: state `converged` below this; as Estimate::hand_sd_m
  std::size_t min_mask_px = 150;           ///< fewer observed pixels in all: hand not in view

  /// Reads the sections `estimator`, `filter` and `silhouette`; what they leave out is as above. Throws
  /// ConfigurationError.
  static EstimatorOptions from(const Configuration& configuration);
};

}  // namespace bodyschema
