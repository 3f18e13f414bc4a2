#pragma once

#include <string>

namespace bodyschema {

/// A size and its interval as people are told them: no digit says more than the interval does.
struct RoundedInterval {
  std::string value, low, high;
};

/// To the decimal place that is at most a third of half the interval, so that rounding moves nothing by more than a
/// sixth of that: 59.12 (58.83 to 59.44) is 59.1 (58.8 to 59.4), and 0.755 (-0.2 to 1.7) is 0.8 (-0.2 to 1.7). Of an
/// interval without width, or without ends, three digits.
RoundedInterval rounded(double value, double low, double high);

/// A size of which nobody knows how far off it is: one digit, two where the first is a one.
std::string roughly(double value);

}  // namespace bodyschema
