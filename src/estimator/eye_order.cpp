#include "eye_order.hpp"

#include <algorithm>
#include <cmath>

namespace bodyschema {

bool EyeOrder::exchanged(double as_they_are, double exchanged) {
  frames_ = std::min(frames_ + 1, kPatience);
  constexpr double kLeast = 1e-3;  // of a distance
  // What no guess comes near is hardly the whole hand: an arm that is just coming in fits somehow.
  constexpr double kNear = 0.4, kVeryNear = 0.3;
  if (std::min(as_they_are, exchanged) > kNear) return evidence_ > kExchanged;
  evidence_ = std::min(evidence_ + std::log(std::max(as_they_are, kLeast) / std::max(exchanged, kLeast)), kMost);
  if (exchanged < kVeryNear && clearly_exchanged(as_they_are, exchanged)) return true;
  return evidence_ > kExchanged && !clearly_exchanged(exchanged, as_they_are);
}

}  // namespace bodyschema
