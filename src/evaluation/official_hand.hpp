#pragma once

#include <filesystem>
#include <string>

namespace bodyschema {

/// A robot with another robot's hand: where one is held by the other.
struct HandGraft {
  std::filesystem::path arm_urdf;   ///< the robot that keeps everything it has
  std::filesystem::path hand_urdf;  ///< the robot whose hand is taken
  std::string arm_link;             ///< hand frame of the first robot
  std::string hand_root;            ///< link of the second robot that moves over, with all beyond it
  std::string hand_frame;           ///< fixed to hand_root: what coincides with arm_link ...
  double along_z_m = 0.0;           ///< ... this much further out along its z axis
  std::string prefix;               ///< put before the names of the links that move over
};

/// Writes the URDF of the robot that `graft` describes. The second robot's hand keeps its joint
/// names; relative mesh names stay as they are, so that robot.mesh_search_roots must hold both robots' folders.
/// Throws FileError for files that cannot be read or written, DataError for links that are missing.
void write_grafted_urdf(const HandGraft& graft, const std::filesystem::path& out);

}  // namespace bodyschema
