#pragma once

#include <optional>

#include "bodyschema/core/configuration.hpp"

namespace bodyschema {

/// How much later the last row of a camera's pictures is exposed than the first, s (rolling shutter): `readout_ms` of
/// its section; 0: all rows at once. Absent where that is left out or `unknown`. Throws ConfigurationError.
std::optional<double> readout_s(const Configuration& camera);

}  // namespace bodyschema
