#include "search_renders.hpp"

#include <algorithm>
#include <cstdlib>

#include "bodyschema/outline/outline_measurement.hpp"

namespace bodyschema {

int search_renders(const EstimatorOptions& options, const SilhouetteModel& outlines,
                   std::span<const PinholeIntrinsics> cameras) {
  if (options.search_renders > 0) return options.search_renders;
  if (const char* e = std::getenv("SEARCH_RENDERS")) return std::atoi(e);
  static_cast<void>(outlines); static_cast<void>(cameras);
  return 100000;
}

}  // namespace bodyschema
