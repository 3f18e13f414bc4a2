#pragma once

#include <optional>
#include <vector>

#include "bodyschema/diagnosis/diagnosis_report.hpp"
#include "model_fit.hpp"

namespace bodyschema::diagnosis {

/// Offsets from which a fit may get to the outlines where it was caught on the way: the nearest of
/// many scattered ones, always the same for a log. None where the source needs no search.
std::vector<ErrorModel> scattered_starts(MeasurementSource& source, const ErrorModel& offsets);

/// Whether a robot may be built so wrong: a cause of more than twenty times its typical size stands in for
/// another, however well it fits.
bool plausible(const ErrorModel& model);
bool plausible(const Effect& effect);

/// Where a linear search stays far from the outlines: causes tried for real, each with the offsets
/// fitted anew, the one that brings the outlines nearest kept, and so on while it is worth it. What is
/// linear misleads about errors this large. Besides single causes all lengths together are tried (a
/// shifted base and every link), for a model of another robot is wrong in several at once.
/// Returns the offsets and what was found; nothing where no cause brings the outlines clearly nearer.
/// @param offsets  fitted to the outlines as well as they can be
/// @param causes   those that the log can test
std::optional<ErrorModel> nearer_model(MeasurementSource& source, const CoordinateLayout& layout, ModelFitter& fitter,
                                       const ErrorModel& offsets, const std::vector<CauseName>& causes);

}  // namespace bodyschema::diagnosis
