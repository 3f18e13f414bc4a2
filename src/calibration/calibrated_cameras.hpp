#pragma once

#include <vector>

#include "bodyschema/calibration/calibrate.hpp"
#include "bodyschema/evidence/batch_fit.hpp"
#include "bodyschema/evidence/picture_log.hpp"

namespace bodyschema {

/// Where each camera is in the frame of the link that carries it, with which lens, and how well the fit knows that.
std::vector<CalibratedCamera> calibrated_cameras(const PictureLog& log, const BatchFit& batch);

}  // namespace bodyschema
