#include "bodyschema/filter/resampling.hpp"

#include <numeric>

namespace bodyschema {

void systematic_resampling(std::span<const double> weights, double u, std::span<std::size_t> ancestors) {
  const double total = std::accumulate(weights.begin(), weights.end(), 0.0);
  const double step = total / static_cast<double>(ancestors.size());
  double cumulative = weights[0];
  std::size_t i = 0;
  for (std::size_t k = 0; k < ancestors.size(); ++k) {
    const double position = (static_cast<double>(k) + u) * step;
    while (position >= cumulative && i + 1 < weights.size()) cumulative += weights[++i];
    ancestors[k] = i;
  }
}

double effective_sample_size(std::span<const double> weights) {
  double sum = 0.0;
  double squares = 0.0;
  for (const double weight : weights) {
    sum += weight;
    squares += weight * weight;
  }
  return squares > 0.0 ? sum * sum / squares : 0.0;
}

}  // namespace bodyschema
