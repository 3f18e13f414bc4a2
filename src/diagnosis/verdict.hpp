#pragma once

#include <string>
#include <vector>

#include "bodyschema/diagnosis/diagnosis_report.hpp"
#include "bodyschema/effects/across_axis.hpp"
#include "bodyschema/effects/joint_roles.hpp"

namespace bodyschema::diagnosis {

/// The sentence of one cause, with its sizes. @param report  for when the log began
std::string sentence_of(const DiagnosedCause& cause, const DiagnosisReport& report, const JointRoles& roles,
                        const std::vector<AcrossAxis>& across = {});
/// Puts what was found into words: every cause's sentence, the verdict and its own. What is not explained has neither
/// intervals nor limits: they hold for a model that fits.
/// @param across  directions of the joints' axes, for sentences by the URDF's axes; empty: left out
void word_verdict(DiagnosisReport& report, const JointRoles& roles, const std::vector<AcrossAxis>& across = {});

}  // namespace bodyschema::diagnosis
