#pragma once

#include "bodyschema/diagnosis/diagnoser.hpp"
#include "bodyschema/diagnosis/diagnosis_report.hpp"

namespace bodyschema::diagnosis {

/// Words verdict and sentence from a report's causes and held-out errors. A name is only as good as
/// the fit behind it: where more of the residual is left than `trusted_rms_px`, the verdict is
/// "unexplained" whatever was found.
/// @param crowded  several small errors share what is left
void word_verdict(DiagnosisReport& report, const DiagnosisOptions& options, bool crowded);

}  // namespace bodyschema::diagnosis
