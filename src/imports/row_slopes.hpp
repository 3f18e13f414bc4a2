#pragma once

#include <cstddef>
#include <vector>

#include "bodyschema/core/time.hpp"

namespace bodyschema {

/// Velocities of row `i` of readings that come without: the slopes over the rows before and after, as far as these are
/// near in time; 0 where neither is. @param utime  of a row; @param value  of a row and column
template <class Utime, class Value>
std::vector<double> row_slopes(std::size_t i, std::size_t rows, std::size_t columns, const Utime& utime,
                               const Value& value) {
  constexpr Microseconds kNear = 500'000;
  const bool before = i > 0 && utime(i) - utime(i - 1) <= kNear;
  const bool after = i + 1 < rows && utime(i + 1) - utime(i) <= kNear;
  const std::size_t a = before ? i - 1 : i, b = after ? i + 1 : i;
  std::vector<double> slopes(columns, 0.0);
  if (utime(a) >= utime(b)) return slopes;
  for (std::size_t k = 0; k < columns; ++k) slopes[k] = (value(b, k) - value(a, k)) / seconds(utime(b) - utime(a));
  return slopes;
}

}  // namespace bodyschema
