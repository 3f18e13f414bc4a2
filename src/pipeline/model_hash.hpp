#pragma once

#include <optional>
#include <string>

#include "bodyschema/effects/error_model.hpp"
#include "bodyschema/robot/robot_setup.hpp"

namespace bodyschema {

/// Pipeline::model_hash() of a robot that is loaded: 16 hexadecimal digits.
std::string model_hash_of(const RobotSetup& setup, const RobotModel& robot,
                          const std::optional<ErrorModel>& error_model);

}  // namespace bodyschema
