#pragma once

#include <Eigen/Core>
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
};

/// A hypothesis with what it made of the frame.
struct Explanation {
  Hypothesis hypothesis;
  PostureMemory memory;  ///< what is known under it, without the frame
  OutlineFit fit;
  double misfit = 0.0;  ///< chi-square, what free parameters cost counted in
};

/// The best of several hypotheses that explains the frame and does so clearly better than the memory does; nothing
/// where none does. `scorer` must have the frame.
/// @param known  what is remembered
/// @param held  the fit of the frame that it held
std::optional<Explanation> explain(const std::vector<Hypothesis>& hypotheses, const PostureMemory& known,
                                   const OutlineFit& held, double time_s, const Frame& frame, OutlineFitter& fitter);

}  // namespace bodyschema
