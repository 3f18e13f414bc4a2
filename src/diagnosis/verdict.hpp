#pragma once

#include "bodyschema/diagnosis/diagnosis_report.hpp"
#include "bodyschema/effects/joint_roles.hpp"

namespace bodyschema::diagnosis {

/// Puts what was found into words: every cause's sentence, the verdict and its own.
void word_verdict(DiagnosisReport& report, const JointRoles& roles);

}  // namespace bodyschema::diagnosis
