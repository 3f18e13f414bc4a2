#pragma once

#include <Eigen/Core>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "bodyschema/evidence/posture_memory.hpp"
#include "bodyschema/filter/particle_filter.hpp"
#include "outline_fitter.hpp"

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

/// A hypothesis with what it made of the frame.
struct Explanation {
  Hypothesis hypothesis;
  PostureMemory memory;  ///< what is known under it, without the frame
  OutlineFit fit;
};

/// Hypotheses that are tried one after the other, on as many pictures as that takes: each is held against what the
/// memory makes of the picture that it is tried on.
struct ExplanationRound {
  std::vector<Hypothesis> hypotheses;
  std::size_t at = 0;               ///< of these to be tried
  StartSearch search;               ///< of the one at hand
  std::optional<Explanation> best;  ///< so far: explains its picture, and does so clearly better than the memory does
  double gain = 0.0;                ///< of the best: chi-square
};

/// Carries a round on as far as the frame allows. Where it is through, its best has been found on this frame, or found
/// to explain this frame too; there may be none. `scorer` must have the frame.
/// @param known  what is remembered
/// @param held  the fit of the frame that it held
/// @param room  starts that a frame is to leave out
/// @return whether it is through
bool go_on(ExplanationRound& round, const PostureMemory& known, const OutlineFit& held, double time_s,
           const Frame& frame, OutlineFitter& fitter, int room);

}  // namespace bodyschema
