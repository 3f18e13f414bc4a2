#pragma once

#include <cstdint>

namespace bodyschema {

/// Hammoude distance of two regions, equation (3): (#union - #intersection) / #union, in [0, 1].
/// Both images of a stereo pair are concatenated, so counts are summed over cameras before the
/// ratio is taken. An empty union says nothing about the state; callers check it first, here it
/// is the largest distance.
constexpr double hammoude_distance(std::uint64_t union_count, std::uint64_t intersection_count) {
  if (union_count == 0) return 1.0;
  return static_cast<double>(union_count - intersection_count) / static_cast<double>(union_count);
}

/// Image likelihood up to a factor, equation (4): 1 - d.
constexpr double hammoude_likelihood(double distance) {
  return 1.0 - distance;
}

}  // namespace bodyschema
