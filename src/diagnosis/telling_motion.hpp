#pragma once

#include <optional>

#include "bodyschema/diagnosis/diagnosis_report.hpp"
#include "bodyschema/evidence/log_fit.hpp"
#include "bodyschema/robot/motion_file.hpp"

namespace bodyschema::diagnosis {

/// A motion that would tell what a log could not: every joint that the classes of the answer speak of, and its
/// neighbours, swept alone as far as the cameras keep the hand in sight, slowly there and quickly back; the hand near
/// and far and in the corners; neck and eyes turned with the arm still; the first posture in between and again at the
/// end. Begins at the log's own postures. Nothing: the log tells everything that it found apart.
/// Joints stay within the URDF's limits; that parts do not touch is for the user to see.
std::optional<MotionFile> telling_motion(LogFit& fit, const DiagnosisReport& report);

}  // namespace bodyschema::diagnosis
