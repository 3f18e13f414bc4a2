#pragma once

#include <string>
#include <vector>

namespace bodyschema {

/// The candidate with the smallest edit distance to `name`, for "did you mean" in errors; empty
/// when there are no candidates.
std::string nearest_name(const std::string& name, const std::vector<std::string>& candidates);

}  // namespace bodyschema
