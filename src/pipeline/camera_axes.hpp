#pragma once

#include <cstddef>
#include <memory>

#include "bodyschema/camera/stereo_rig.hpp"
#include "bodyschema/robot/robot_model.hpp"
#include "bodyschema/robot/robot_setup.hpp"

namespace bodyschema {

/// Whether the axes of a camera's link look like those of a body (x forward, z up: ROS, REP 103) where OpenCV's are
/// meant (x right, y down, z into the picture): of postures drawn evenly within the joints' limits, the head's too, it
/// would see the hand in far more by the former. False where neither shows it.
/// @throws ConfigurationError  as RobotSetup::default_joints
bool has_body_axes(const std::shared_ptr<const RobotModel>& robot, const RobotSetup& setup, const StereoRig& rig,
                   std::size_t camera);

}  // namespace bodyschema
