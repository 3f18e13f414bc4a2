#pragma once

#include <cstdint>

namespace bodyschema {

/// Acquisition time in microseconds since the epoch of whoever stamped it (LCM's `utime`).
using Microseconds = std::int64_t;

constexpr double seconds(Microseconds t) { return static_cast<double>(t) * 1e-6; }
constexpr Microseconds microseconds(double t_s) {
  return static_cast<Microseconds>(t_s * 1e6 + (t_s < 0 ? -0.5 : 0.5));
}

}  // namespace bodyschema
