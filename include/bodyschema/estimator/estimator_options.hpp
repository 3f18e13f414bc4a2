#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "bodyschema/core/configuration.hpp"
#include "bodyschema/evidence/outline_noise.hpp"
#include "bodyschema/evidence/posture_memory.hpp"
#include "bodyschema/evidence/state.hpp"
#include "bodyschema/filter/particle_filter.hpp"
#include "bodyschema/geometry/pose.hpp"
#include "bodyschema/silhouette/silhouette_scorer.hpp"

namespace bodyschema {

enum class EstimatorMode {
  kPaper,  ///< the paper's filter, literally
  kBest,   ///< sharper likelihood, outline refinement, fusion over postures
};

/// Everything that config/estimator.yaml sets, with the values it has there. What is believed of the robot
/// (`estimator.state`, `robot.tolerances`) depends on which robot it is: Beliefs.
struct EstimatorOptions {
  EstimatorMode mode = EstimatorMode::kBest;
  ParticleFilterOptions filter;
  SilhouetteOptions silhouette;
  double temperature = 0.02;   ///< best: weight = exp(-(d - d_min) / temperature)
  bool refine_outline = true;  ///< best: without it the estimate is one of the particles
  bool remember = true;        ///< best: postures are fused; false: every frame for itself
  int search_renders = 0;      ///< best: how often searches may look at one frame anew; 0: by the pictures' pixels
  double outline_spacing_px = 3.0;
  OutlineNoise::Prior noise;  ///< best: believed of outlines before any was seen
  MemoryOptions memory;
  double stamp_sd_s = 3e-4;          ///< best: of pictures' stamps, from picture to picture, before any was seen
  std::size_t least_postures = 3;    ///< distinct ones that must agree before `converged`
  double converged_hand_sd_m = 0.0;  ///< best: `converged` below this; 0: by tolerances and the camera's distance
  bool live_diagnosis = true;        ///< best: the service looks for what is wrong beside the state
  double min_mask_share = 0.001;     ///< of the picture; less observed robot than this: hand not in view

  /// Reads the sections `estimator`, `filter` and `silhouette`; what they leave out is as above. Throws
  /// ConfigurationError.
  static EstimatorOptions from(const Configuration& configuration);
};

/// What is believed of the places of cameras that are not known: of the rig, and of its second camera against the
/// first.
std::vector<Belief> camera_beliefs(const StereoRig& rig);

/// What is believed of a robot before any picture.
struct Beliefs {
  std::vector<Belief> state;       ///< what is estimated (`estimator.state`)
  std::vector<Belief> tolerances;  ///< what may be wrong besides, and is considered (`robot.tolerances`)
  /// Reads both; in mode paper the state is the joints' offsets alone. What is believed of the cameras' places stands
  /// with the cameras. Throws ConfigurationError.
  static Beliefs from(const Configuration& configuration, const JointRoles& roles, const StereoRig& rig,
                      const EstimatorOptions& options);
};

}  // namespace bodyschema
