#pragma once

#include <memory>
#include <span>

#include "bodyschema/silhouette/silhouette_scorer.hpp"

namespace bodyschema {

/// The CPU engine: finds contour edges, turns them into winding numbers by their column crossings
/// and counts bits. Throws what contour::check does.
std::unique_ptr<SilhouetteScorer> make_contour_scorer(const SilhouetteModel& model,
                                                      std::span<const PinholeIntrinsics> cameras, int threads);

}  // namespace bodyschema
