#pragma once

#include <nlohmann/json.hpp>

#include "bodyschema/camera/stereo_rig.hpp"
#include "bodyschema/estimator/estimate.hpp"

namespace bodyschema {

/// What estimate_line() writes, for those who add to it.
nlohmann::ordered_json estimate_json(const Estimate& estimate, const StereoRig& rig);

}  // namespace bodyschema
