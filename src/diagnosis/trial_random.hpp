#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>

#include "bodyschema/geometry/pose.hpp"

namespace bodyschema::diagnosis {

/// Seeded numbers that are the same on every machine; the library's distributions differ.
class TrialRandom {
 public:
  explicit TrialRandom(std::uint64_t seed) : random_(seed) {}
  double uniform(double low, double high) {
    return low + (high - low) * (static_cast<double>(random_() >> 11) * 0x1.0p-53);
  }
  /// Standard normal, after Box and Muller.
  double normal() {
    const double u = std::max(1e-300, uniform(0.0, 1.0));
    return std::sqrt(-2.0 * std::log(u)) * std::cos(2.0 * kPi * uniform(0.0, 1.0));
  }
  std::size_t below(std::size_t n) { return static_cast<std::size_t>(random_() % n); }

 private:
  std::mt19937_64 random_;
};

}  // namespace bodyschema::diagnosis
