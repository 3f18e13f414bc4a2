#pragma once

#include <vector>

#include "bodyschema/diagnosis/diagnosis_report.hpp"
#include "bodyschema/diagnosis/selection.hpp"
#include "candidates.hpp"
#include "model_fit.hpp"

namespace bodyschema::diagnosis {

/// One pass over the catalogue and the model it led to.
struct Found {
  CandidateSet set;
  Selection selection;
  ErrorModel extended;
  ModelFit after;
};

CauseName name_of(const Candidate& candidate);

/// The figures of the report: causes with their intervals, limits, bars, offsets, and the errors on
/// held-out blocks before and after. The verdict is not worded yet.
DiagnosisReport findings(MeasurementSource& source, const SelectionOptions& rules, const CoordinateLayout& layout,
                         const BlockPlan& plan, const Found& found, const ErrorModel& baseline, const ModelFit& before,
                         const std::vector<NotTestable>& excluded, double systematic_share,
                         const std::map<std::string, double>& systematic_error);

}  // namespace bodyschema::diagnosis
