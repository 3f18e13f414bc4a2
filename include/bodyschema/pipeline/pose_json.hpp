#pragma once

#include <nlohmann/json.hpp>

#include "bodyschema/geometry/pose.hpp"

namespace bodyschema {

/// A pose as rows of its 4x4 matrix, m.
inline nlohmann::ordered_json pose_json(const Pose& X) {
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  for (int r = 0; r < 4; ++r) rows.push_back({X(r, 0), X(r, 1), X(r, 2), X(r, 3)});
  return rows;
}

}  // namespace bodyschema
