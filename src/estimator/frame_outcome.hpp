#pragma once

#include <string>

#include "bodyschema/estimator/estimate.hpp"
#include "bodyschema/evidence/posture_memory.hpp"

namespace bodyschema {

/// What one frame came to, of all that an estimate says of it.
struct FrameOutcome {
  EstimatorState state = EstimatorState::kHandNotInView;
  FrameVerdict verdict = FrameVerdict::kNothingKnown;
  Innovation innovation;
  bool contradicted = false;  ///< the memory does not explain it
  bool near = false;          ///< its outlines lie near what is reported
  bool hidden_only = false;   ///< it contradicts by what is hidden alone
  bool cameras_swapped = false;
  HiddenShare hidden;
  double best_likelihood = 0.0, effective_size = 0.0, rms_px = 0.0;
  std::string changed;  ///< what is taken to have happened: "r_elbow slipped by 4.9 deg"
};

}  // namespace bodyschema
