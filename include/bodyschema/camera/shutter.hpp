#pragma once

#include "bodyschema/core/configuration.hpp"

namespace bodyschema {

/// What the configuration knows of how a camera reads its rows out.
struct Shutter {
  double readout_s = 0.0;  ///< the last row is exposed this much later than the first; 0: all at once
  double sd_s = 0.0;       ///< standard deviation that is believed of it
};

/// Of a camera's section: `readout_ms`, a number, `unknown`, or left out: all rows at once. Throws ConfigurationError.
Shutter shutter_of(const Configuration& camera);

}  // namespace bodyschema
