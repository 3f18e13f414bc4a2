#pragma once

#include <cstdint>

#include "bodyschema/core/time.hpp"

namespace bodyschema {

/// Now, microseconds of a clock that never steps: for durations and freshness.
[[nodiscard]] std::int64_t monotonic_us();

/// Now, microseconds since the epoch: what stamps messages and logs. May step.
[[nodiscard]] Microseconds wall_us();

}  // namespace bodyschema
