#pragma once

#include <span>

#include "bodyschema/estimator/estimator_options.hpp"
#include "bodyschema/silhouette/silhouette_scorer.hpp"

namespace bodyschema {

/// How often the searches of one frame may draw outlines and look for them in the pictures of all cameras: as configured,
/// or as often as costs what they cost with a light robot in small pictures, where all of a search is done at once. By
/// what is drawn, not by the clock: the same on every machine.
/// @param outlines  what is drawn
/// @param cameras  of the full pictures
int search_renders(const EstimatorOptions& options, const SilhouetteModel& outlines,
                   std::span<const PinholeIntrinsics> cameras);

}  // namespace bodyschema
