#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "bodyschema/core/configuration.hpp"
#include "bodyschema/geometry/face_culling.hpp"
#include "bodyschema/robot/robot_model.hpp"

namespace bodyschema {

/// The `robot` section of a configuration: which robot, which links and joints matter, and how it
/// stands. Names are checked against the URDF by `load` and `default_joints`.
struct RobotSetup {
  RobotModelOptions model;
  FaceCulling culling = FaceCulling::kNone;
  std::string hand_link;                      ///< frame P, whose pose is reported
  std::vector<std::string> fingertip_links;   ///< may be empty
  std::vector<std::string> estimated_joints;  ///< the arm joints whose offsets are estimated; they turn
  std::vector<std::string> head_joints;       ///< between root and cameras; they turn
  /// Values of joints the robot does not publish: rad, of sliding ones m.
  std::map<std::string, double> fixed_joints_rad, fixed_joints_m;
  Eigen::Vector3d gravity_W = {0, 0, -9.81};  ///< m/s^2 in the root frame
  std::filesystem::path extended_model;       ///< of `bodyschema diagnose` (ErrorModel); empty: none
  /// Where the names above stand, by key ("hand_link", "fixed_joints_deg.r_index"): Configuration::place.
  std::map<std::string, std::string> places;

  /// Reads the `robot` section. Throws ConfigurationError.
  static RobotSetup from(const Configuration& robot);

  /// The robot, with every link and joint named above known to exist. Throws FileError for URDF and
  /// meshes, ConfigurationError naming file, key, name and nearest name otherwise.
  [[nodiscard]] std::shared_ptr<const RobotModel> load() const;
  /// A joint vector in `robot`'s order with the fixed joints at their values and all others at
  /// zero, moved into their limits.
  [[nodiscard]] Eigen::VectorXd default_joints(const RobotModel& robot) const;
};

}  // namespace bodyschema
