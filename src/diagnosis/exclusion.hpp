#pragma once

#include <vector>

#include "bodyschema/diagnosis/diagnosis_report.hpp"
#include "findings.hpp"
#include "interval.hpp"

namespace bodyschema::diagnosis {

/// How large every cause could still be that a report neither names nor holds possible in a class:
/// each is fitted beside the final model, linear about it. Of a slip the hardest time to see it counts.
/// Causes that differ in nothing from what is fitted go to the report's `not_testable`.
/// @param report  its causes and what is not testable are known
void add_exclusion_limits(MeasurementSource& source, const CoordinateLayout& layout, const BlockPlan& plan,
                          const Found& found, const IntervalRule& rule, DiagnosisReport& report);

}  // namespace bodyschema::diagnosis
