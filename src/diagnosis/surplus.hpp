#pragma once

#include "bodyschema/evidence/log_fit.hpp"
#include "candidates.hpp"

namespace bodyschema::diagnosis {

/// What pictures show beyond the robot as a model has it.
struct Surplus {
  double blocks = 0.0;   ///< share of the log's blocks in which there is some
  double area_m2 = 0.0;  ///< median over these, at the hand's depth
};

/// Something held, a part that the meshes lack, another arm: no outline that the model predicts has a counterpart
/// there, so that no residual shows it. Looked for where masks reach further beyond the predicted silhouette than any
/// outline is searched for, in pieces as wide as that.
/// @param pictures  which are looked at
Surplus surplus(LogFit& fit, const LogAbout& log, const std::vector<std::size_t>& pictures);

}  // namespace bodyschema::diagnosis
