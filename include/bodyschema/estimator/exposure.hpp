#pragma once

#include "bodyschema/effects/instant.hpp"
#include "bodyschema/observation/corrections.hpp"

namespace bodyschema {

/// Where the robot was when a camera looked, as far as it is known without looking: what its pose is predicted from.
struct Exposure {
  Instant at;
  /// What effects with a memory (backlash) had come to at that time; none of them: empty.
  Corrections remembered;
};

}  // namespace bodyschema
