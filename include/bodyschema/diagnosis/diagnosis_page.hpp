#pragma once

#include <string>
#include <utility>
#include <vector>

#include "bodyschema/diagnosis/diagnosis_report.hpp"
#include "bodyschema/geometry/image.hpp"
#include "bodyschema/report/report.hpp"

namespace bodyschema {

/// The diagnosis as a page for people: verdict, causes, gain on held-out blocks, pictures, all
/// candidates against the threshold, what is left against everything it could follow before and
/// after the extension, and what the log cannot test.
/// @param title  what was diagnosed
/// @param pictures  overlays with their captions
Report diagnosis_page(const DiagnosisReport& diagnosis, const std::string& title,
                      const std::vector<std::pair<Image, std::string>>& pictures);

}  // namespace bodyschema
