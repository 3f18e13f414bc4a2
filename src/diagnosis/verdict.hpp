#pragma once

#include <string>

#include "bodyschema/diagnosis/diagnosis_report.hpp"
#include "bodyschema/effects/joint_roles.hpp"

namespace bodyschema::diagnosis {

/// The sentence of one cause, with its sizes. @param report  for when the log began
std::string sentence_of(const DiagnosedCause& cause, const DiagnosisReport& report, const JointRoles& roles);
/// Puts what was found into words: every cause's sentence, the verdict and its own. What is not explained has neither
/// intervals nor limits: they hold for a model that fits.
void word_verdict(DiagnosisReport& report, const JointRoles& roles);

}  // namespace bodyschema::diagnosis
