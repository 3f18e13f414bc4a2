#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "bodyschema/vision/robot_looks.hpp"

namespace bodyschema {

/// The robot's colours by camera, as `vision.method: auto` has learned them.
using LooksByCamera = std::map<std::string, RobotLooks>;

/// A file of JSON, docs/masks.md: the robot's colours for the next start.
/// @param robot  Pipeline::model_hash(): the colours of another robot are of no use
void write_looks(const std::filesystem::path& file, const std::string& robot, const LooksByCamera& looks);
/// Throws FileError that names file, key and what was expected; also for the looks of another robot.
LooksByCamera read_looks(const std::filesystem::path& file, const std::string& robot);

/// Where a service keeps them: in the configured file or, where that cannot be written, in the user's folder for state
/// ($XDG_STATE_HOME, else ~/.local/state).
class LooksKeeper {
 public:
  /// @param file  `vision.looks_file`
  LooksKeeper(std::filesystem::path file, std::string robot);
  /// What an earlier run has left; empty where there is nothing, or nothing of use, which is warned of.
  [[nodiscard]] LooksByCamera read() const;
  /// Never throws: a service goes on without. Warns once where nothing can be written.
  void write(const LooksByCamera& looks);

 private:
  std::filesystem::path file_, elsewhere_;  ///< elsewhere_: empty where the user has no such folder
  std::string robot_;
  bool warned_ = false;
};

}  // namespace bodyschema
