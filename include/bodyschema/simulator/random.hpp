#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "bodyschema/core/digest.hpp"
#include "bodyschema/core/seeded_random.hpp"

namespace bodyschema::simulator {

/// A seeded random stream (xoshiro256++, seeded by SplitMix64): the same numbers on every machine
/// and with every standard library. Give each use its own stream (`Random(seed, "encoder noise")`)
/// so that drawing more of one thing never changes another. One thread. Not SeededRandom: with one
/// seed, the simulator must not draw what the estimator draws, and 32 bytes begin a stream where a Mersenne Twister
/// needs 2.5 kB.
class Random {
 public:
  Random(std::uint64_t seed, std::string_view purpose, std::uint64_t index = 0) {
    std::uint64_t x = seed ^ std::rotl(Digest().add(purpose).value(), 23) ^ (index * 0x9e3779b97f4a7c15u);
    for (auto& word : state_) word = mixed_bits(x += 0x9e3779b97f4a7c15u);
  }

  std::uint64_t bits() {
    const std::uint64_t result = std::rotl(state_[0] + state_[3], 23) + state_[0];
    const std::uint64_t t = state_[1] << 17;
    state_[2] ^= state_[0];
    state_[3] ^= state_[1];
    state_[1] ^= state_[2];
    state_[0] ^= state_[3];
    state_[2] ^= t;
    state_[3] = std::rotl(state_[3], 45);
    return result;
  }

  /// In [0, 1).
  double uniform() { return static_cast<double>(bits() >> 11) * 0x1.0p-53; }
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  /// In 0 .. count-1; count > 0.
  std::size_t below(std::size_t count) { return static_cast<std::size_t>(uniform() * static_cast<double>(count)); }
  double sign() { return (bits() >> 63) != 0 ? 1.0 : -1.0; }

  /// Standard normal (Marsaglia's polar method).
  double normal() {
    if (has_spare_) {
      has_spare_ = false;
      return spare_;
    }
    double u = 0.0;
    double v = 0.0;
    double s = 0.0;
    do {
      u = 2.0 * uniform() - 1.0;
      v = 2.0 * uniform() - 1.0;
      s = u * u + v * v;
    } while (s >= 1.0 || s == 0.0);
    const double scale = std::sqrt(-2.0 * std::log(s) / s);
    spare_ = v * scale;
    has_spare_ = true;
    return u * scale;
  }

 private:
  std::array<std::uint64_t, 4> state_{};
  double spare_ = 0.0;
  bool has_spare_ = false;
};

}  // namespace bodyschema::simulator
