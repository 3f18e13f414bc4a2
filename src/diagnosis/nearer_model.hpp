#pragma once

#include <optional>
#include <vector>

#include "bodyschema/diagnosis/diagnosis_report.hpp"
#include "model_fit.hpp"

namespace bodyschema::diagnosis {

/// Offsets from which a fit may get to the outlines where it was caught on the way: the nearest of
/// many scattered ones, always the same for a log. None where the source needs no search.
std::vector<ErrorModel> scattered_starts(MeasurementSource& source, const ErrorModel& offsets);

/// The time that splits the log into the two parts whose outlines lie most unlike far off.
struct Turning {
  double time_s = 0.0;         ///< since the Unix epoch
  double unlike = 1.0;         ///< mean cost of an outline point (px^2) in the worse part over that in the better one
  bool later_is_worse = true;  ///< which part lies further off
  double worse_share = 0.0;    ///< of the pictures in which an outline was predicted
};
/// Nothing where no picture has an outline, or all of them at one time.
std::optional<Turning> turning(const MeasurementSource& source, const Linearisation& at);

/// Where a joint slipped further than counterparts are looked for, offsets fit one part of the log and the outlines of
/// the other are out of sight: offsets with the slip, of whatever joint, that brings both parts near. None where
/// none does. Where the source needs no search, nothing is nearer than offsets alone.
/// @param offsets  fitted to the outlines as well as they can be
std::optional<ErrorModel> slipped_start(MeasurementSource& source, ModelFitter& fitter, const ErrorModel& offsets);

/// Moves slips of the model to when the outlines ask for them: pictures in which the outline was out of sight, for the
/// slip was not in the model yet, said nothing of its time. Returns whether one moved further than a cell of a slip.
bool retime_slips(MeasurementSource& source, ErrorModel& model);

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
