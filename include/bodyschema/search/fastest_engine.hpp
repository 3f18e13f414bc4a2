#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "bodyschema/silhouette/silhouette_scorer.hpp"

namespace bodyschema {

/// The options with `engine` and `gl_pass` settled where they say "auto". With a GPU, what is left open is decided by
/// time_engines, in half a second, once for a machine, its driver and a robot: the figures are kept in the user's cache
/// (core/user_cache.hpp). Where GL is drawn by the processor, or there is none, nothing is measured: contour does the
/// same there with less work.
/// @param silhouettes  that are scored at once
/// @param reason  receives why, with the figures
SilhouetteOptions fastest_engine(const SilhouetteModel& model, std::span<const PinholeIntrinsics> cameras,
                                 const SilhouetteOptions& options, std::size_t silhouettes, std::string& reason);

/// The same from given figures; contour where all failed. @param timings  not empty
SilhouetteOptions fastest_of(std::span<const EngineTiming> timings, const SilhouetteOptions& options,
                             std::string& reason);

/// What the cache holds under `key`, or what `measure` finds, which is then kept there.
std::vector<EngineTiming> remembered_timings(const std::string& key,
                                             const std::function<std::vector<EngineTiming>()>& measure);

}  // namespace bodyschema
