#pragma once

#include <filesystem>
#include <string>

#include "bodyschema/core/configuration.hpp"
#include "bodyschema/robot/robot_setup.hpp"
#include "test_data.hpp"

namespace bodyschema {

inline Configuration robot_configuration(const std::string& file) {
  return Configuration::load(std::filesystem::path(BODYSCHEMA_SOURCE_DIR) / "config" / file);
}

inline RobotSetup robot_setup(const std::string& file) {
  return RobotSetup::from(robot_configuration(file).section("robot"));
}

}  // namespace bodyschema
