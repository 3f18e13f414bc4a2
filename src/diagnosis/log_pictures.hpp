#pragma once

#include <string>
#include <utility>
#include <vector>

#include "bodyschema/diagnosis/diagnosis_report.hpp"
#include "bodyschema/evidence/log_fit.hpp"

namespace bodyschema::diagnosis {

/// A few of a log's pictures for the page about it: the hand enlarged with the outlines of the fit before and after the
/// extension, where the extension helps most, after a picture in which the parts that the answer is about are tinted;
/// with the outline of the encoders as they are where nothing was found.
/// @param kept  observations whose pictures are at hand
std::vector<std::pair<Image, std::string>> draw_pictures(LogFit& fit, const std::vector<Observation>& kept,
                                                         const DiagnosisReport& report);

}  // namespace bodyschema::diagnosis
