#pragma once

#include "bodyschema/diagnosis/diagnoser.hpp"
#include "bodyschema/diagnosis/diagnosis_report.hpp"

namespace bodyschema::diagnosis {

/// Words verdict and sentence from a report's causes and held-out errors. A name is only as good as
/// the fit behind it: where more of the residual is left than `trusted_rms_px`, the verdict is
/// "unexplained" whatever was found; so it is where less of the outlines than `trusted_outline` was found; so it is
/// where nothing was found and more than `noise_rms_px` is left that no crowd of small errors shares, where the log
/// does not tell the size of a cause, and where that is implausible.
void word_verdict(DiagnosisReport& report, const DiagnosisOptions& options);

}  // namespace bodyschema::diagnosis
