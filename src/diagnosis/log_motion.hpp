#pragma once

#include <span>
#include <vector>

#include "bodyschema/diagnosis/diagnosis_report.hpp"
#include "bodyschema/effects/effect_kind.hpp"
#include "bodyschema/robot/robot_setup.hpp"

namespace bodyschema::diagnosis {

/// What encoders show of a log's motion.
/// @param pictures  joints at every exposure
/// @param cameras  how many gave pictures
/// @param encoders  all readings, in order of time
LogMotion log_motion(std::span<const JointSample> pictures, std::size_t cameras, std::span<const JointSample> encoders,
                     const std::shared_ptr<const RobotModel>& robot, const RobotSetup& setup, const JointRoles& roles);

/// Causes that a log with this motion says nothing about, and why.
std::vector<NotTestable> untestable(const JointRoles& roles, const LogMotion& motion);

}  // namespace bodyschema::diagnosis
