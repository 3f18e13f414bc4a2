#pragma once

#include <vector>

namespace bodyschema::test {

/// Fewest right answers that a tool which is right with these probabilities falls short of less often
/// than `chance`.
inline int fewest_right(const std::vector<double>& rates, double chance = 1e-3) {
  std::vector<double> exactly = {1.0};  // 0, 1, 2.. right answers
  for (const double rate : rates) {
    exactly.push_back(0.0);
    for (std::size_t k = exactly.size() - 1; k > 0; --k) {
      exactly[k] = exactly[k] * (1.0 - rate) + exactly[k - 1] * rate;
    }
    exactly[0] *= 1.0 - rate;
  }
  double at_most = 0.0;
  int k = 0;
  for (; k < static_cast<int>(rates.size()); ++k) {
    at_most += exactly[static_cast<std::size_t>(k)];
    if (at_most > chance) break;
  }
  return k;
}

/// Attempts of which one at least succeeds but for once in a thousand, each with this probability.
inline int attempts_at(double rate) {
  int attempts = 1;
  for (double missed = 1.0 - rate; missed >= 1e-3; missed *= 1.0 - rate) ++attempts;
  return attempts;
}

}  // namespace bodyschema::test
