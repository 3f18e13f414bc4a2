#pragma once

#include <string>
#include <vector>

#include "bodyschema/calibration/calibrate.hpp"
#include "bodyschema/evidence/batch_fit.hpp"
#include "bodyschema/pipeline/pipeline.hpp"

namespace bodyschema {

/// Whether an effect of the catalogue says where cameras are: cameras.yaml holds it.
bool places_cameras(const std::string& effect);

/// Writes everything that `calibrate` promises. `log` has the robot and rig that the fit ended with.
void write_calibration(const Calibration& calibration, const BatchFit& batch, PictureLog& log,
                       const std::vector<Observation>& kept, const Pipeline& pipeline,
                       const Configuration& configuration, const CalibrationOptions& options);

}  // namespace bodyschema
