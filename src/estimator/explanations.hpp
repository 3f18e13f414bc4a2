#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "bodyschema/evidence/posture_memory.hpp"
#include "hypotheses.hpp"
#include "outline_fitter.hpp"

namespace bodyschema {

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
bool go_on(ExplanationRound& round, const PostureMemory& known, const OutlineFit& held, const Frame& frame,
           OutlineFitter& fitter, int room);

}  // namespace bodyschema
