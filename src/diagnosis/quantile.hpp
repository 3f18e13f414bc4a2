#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace bodyschema::diagnosis {

/// The value that this share of the others lies below, one of them; 0 of none.
/// @param share  0 to 1
inline double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0.0;
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

}  // namespace bodyschema::diagnosis
