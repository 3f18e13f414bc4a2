#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>

#include "bodyschema/core/configuration.hpp"
#include "bodyschema/robot/robot_setup.hpp"

namespace bodyschema {

/// Folder of the recording and the official models, or empty where this machine has none.
inline std::filesystem::path data_folder() {
  const char* variable = std::getenv("BODYSCHEMA_DATA");
  const std::filesystem::path folder =
      variable != nullptr ? std::filesystem::path(variable)
                          : std::filesystem::path(BODYSCHEMA_SOURCE_DIR) / "../shared/data";
  return std::filesystem::is_directory(folder) ? folder : std::filesystem::path();
}

#define SKIP_WITHOUT_DATA() \
  if (data_folder().empty()) GTEST_SKIP() << "no test data; set BODYSCHEMA_DATA"

inline Configuration robot_configuration(const std::string& file) {
  return Configuration::load(std::filesystem::path(BODYSCHEMA_SOURCE_DIR) / "config" / file);
}

inline RobotSetup robot_setup(const std::string& file) {
  return RobotSetup::from(robot_configuration(file).section("robot"));
}

}  // namespace bodyschema
