#pragma once

#include <vector>

namespace bodyschema {

/// Mean, sample standard deviation, median and largest of a list; zeros for an empty one.
struct Statistics {
  double mean = 0.0;
  double sd = 0.0;
  double median = 0.0;
  double worst = 0.0;
  static Statistics of(std::vector<double> values);
};

}  // namespace bodyschema
