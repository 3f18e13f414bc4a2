#pragma once

#include <nlohmann/json.hpp>

#include "bodyschema/camera/stereo_rig.hpp"
#include "bodyschema/effects/error_model.hpp"
#include "bodyschema/estimator/estimate.hpp"

namespace bodyschema {

/// What estimate_line() writes, for those who add to it.
nlohmann::ordered_json estimate_json(const Estimate& estimate, const StereoRig& rig);

/// The effects of an extended model with their parameters in the units people read, so that a
/// summary says what its estimate was made with.
nlohmann::ordered_json error_model_json(const ErrorModel& model);

}  // namespace bodyschema
