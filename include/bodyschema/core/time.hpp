#pragma once

#include <cstdint>

namespace bodyschema {

/// Acquisition time in microseconds since the epoch of whoever stamped it (LCM's `utime`).
using Microseconds = std::int64_t;

/// No input may have a time beyond (year 2255): the difference of two is a number.
constexpr Microseconds kLatestStamp = 9'000'000'000'000'000;

constexpr double seconds(Microseconds t) {
  return static_cast<double>(t) * 1e-6;
}
constexpr Microseconds microseconds(double t_s) {
  return static_cast<Microseconds>(t_s * 1e6 + (t_s < 0 ? -0.5 : 0.5));
}

}  // namespace bodyschema
