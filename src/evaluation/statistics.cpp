#include "bodyschema/evaluation/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace bodyschema {

Statistics Statistics::of(std::vector<double> values) {
  Statistics s;
  if (values.empty()) return s;
  const double n = static_cast<double>(values.size());
  s.mean = std::accumulate(values.begin(), values.end(), 0.0) / n;
  double squares = 0.0;
  for (const double v : values) squares += (v - s.mean) * (v - s.mean);
  s.sd = values.size() > 1 ? std::sqrt(squares / (n - 1.0)) : 0.0;
  std::sort(values.begin(), values.end());
  const std::size_t half = values.size() / 2;
  s.median = values.size() % 2 == 1 ? values[half] : 0.5 * (values[half - 1] + values[half]);
  s.worst = values.back();
  return s;
}

}  // namespace bodyschema
