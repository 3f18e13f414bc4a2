#pragma once

#include <string>
#include <vector>

#include "bodyschema/diagnosis/log_diagnosis.hpp"

namespace bodyschema::diagnosis {

/// What to do with an answer, as commands. @param has_motion  motion.csv lies beside the report
std::vector<std::string> next_steps(const std::string& verdict, const LogDiagnosisOptions& options, bool has_motion);

}  // namespace bodyschema::diagnosis
