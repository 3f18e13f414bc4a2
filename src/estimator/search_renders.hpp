#pragma once

#include <span>

#include "bodyschema/estimator/estimator_options.hpp"
#include "bodyschema/geometry/pinhole.hpp"

namespace bodyschema {

/// How often the searches of one frame may draw outlines and look for them in its pictures: as configured, or by the
/// pixels of all cameras. What a frame costs besides grows with these, and what it leaves of its time shrinks. Not by
/// the clock: a replay finds what was found live, on every machine.
int search_renders(const EstimatorOptions& options, std::span<const PinholeIntrinsics> cameras);

}  // namespace bodyschema
