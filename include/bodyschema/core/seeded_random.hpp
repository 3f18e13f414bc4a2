#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <random>

namespace bodyschema {

/// SplitMix64's output function: numbers that differ by little become numbers that have nothing in common.
constexpr std::uint64_t mixed_bits(std::uint64_t z) {
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
  return z ^ (z >> 31);
}

/// Random numbers that are the same for a seed on every machine: the distributions of the standard library differ
/// from one library to the next. The simulator has its own (simulator/random.hpp).
class SeededRandom {
 public:
  explicit SeededRandom(std::uint64_t seed) : random_(seed) {}
  /// Evenly from [low, high).
  double uniform(double low, double high) {
    return low + (high - low) * (static_cast<double>(random_() >> 11) * 0x1.0p-53);
  }
  /// Standard normal, after Box and Muller.
  double normal() {
    const double u = std::max(1e-300, uniform(0.0, 1.0));
    return std::sqrt(-2.0 * std::log(u)) * std::cos(2.0 * std::numbers::pi * uniform(0.0, 1.0));
  }
  /// One of 0 .. n - 1. @param n  more than 0
  std::size_t below(std::size_t n) { return static_cast<std::size_t>(random_() % n); }

 private:
  std::mt19937_64 random_;
};

}  // namespace bodyschema
