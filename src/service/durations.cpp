#include "bodyschema/service/durations.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>

namespace bodyschema {

double RecentDurations::quantile_ms(double q) const {
  const std::size_t n = size();
  if (n == 0) return 0.0;
  std::vector<double> sorted(values_ms_.begin(), values_ms_.begin() + static_cast<std::ptrdiff_t>(n));
  const double share = std::clamp(q, 0.0, 1.0) * static_cast<double>(n);
  const auto rank = std::max<std::ptrdiff_t>(0, static_cast<std::ptrdiff_t>(std::ceil(share)) - 1);
  std::nth_element(sorted.begin(), sorted.begin() + rank, sorted.end());
  return sorted[static_cast<std::size_t>(rank)];
}

void DurationHistogram::add(double ms) {
  const auto bin = std::lower_bound(kUpper_ms.begin(), kUpper_ms.end(), ms) - kUpper_ms.begin();
  ++counts_[static_cast<std::size_t>(bin)];
}

void StageDurations::add(const Frame& frame_ms) {
  for (std::size_t i = 0; i < stages_.size(); ++i) stages_[i].add(frame_ms[i]);
}

std::string StageDurations::table() const {
  std::string text = fmt::format("{:<14} {:>10} {:>10} {:>10}   over {} frames\n", "stage, ms", "median", "p99", "max",
                                 stages_.front().size());
  for (std::size_t i = 0; i < stages_.size(); ++i) {
    text += fmt::format("{:<14} {:>10.2f} {:>10.2f} {:>10.2f}\n", kNames[i], stages_[i].quantile_ms(0.5),
                        stages_[i].quantile_ms(0.99), stages_[i].quantile_ms(1.0));
  }
  return text;
}

}  // namespace bodyschema
