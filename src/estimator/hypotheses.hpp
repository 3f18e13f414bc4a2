#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <limits>
#include <string>
#include <vector>

#include "bodyschema/evidence/posture_memory.hpp"
#include "frame_outcome.hpp"
#include "fused_state.hpp"
#include "outline_fitter.hpp"
#include "particle_search.hpp"

namespace bodyschema {

/// What may have happened where a frame contradicts what is known: parameters that changed, and where to look for
/// their new values. All are fitted and compared alike.
struct Hypothesis {
  std::string what;  ///< "r_elbow slipped", "the camera was knocked", "everything is to be found anew"
  std::vector<Eigen::Index> released;      ///< parameters that changed; all: nothing known holds
  std::vector<Eigen::VectorXd> starts;     ///< states to look from
  const PostureMemory* instead = nullptr;  ///< a memory that explains the frame with nothing changed since; null: none
  /// Whether silhouettes alone decide against a memory that does not explain the outline at all: one so young that
  /// nothing is lost with it.
  bool by_silhouette = false;
  /// Parameters that `instead` knows and the memory hardly does: what that memory was spared when it was taken.
  std::size_t known_instead = 0;
  /// Since when what was released may have been changing, unnoticed, s.
  double doubted_since_s = std::numeric_limits<double>::infinity();
};

/// All that is tried where a frame does not agree with what is known, or that is so young that it may be wrong.
/// @param fit  what the memory made of the frame, and `outcome` how they agree
std::vector<Hypothesis> hypotheses(const FusedState& known, const State& state, const OutlineFit& fit,
                                   const FrameOutcome& outcome, const Frame& frame, ParticleSearch& particles);

}  // namespace bodyschema
