#pragma once

#include <Eigen/Geometry>
#include <filesystem>
#include <map>
#include <string>

namespace bodyschema {

/// Forward kinematics for tests that shares nothing with the library: URDF text searched for its
/// joints, fixed roll-pitch-yaw rotations and Rodrigues' formula multiplied from the root. Joint
/// values by name; mimic joints follow (one level); an absent joint is at zero.
class UrdfWalk {
 public:
  explicit UrdfWalk(const std::filesystem::path& urdf);
  [[nodiscard]] Eigen::Matrix4d pose(const std::string& link, const std::map<std::string, double>& q) const;
  /// Position of the link's centre of mass in the root frame, and its mass.
  [[nodiscard]] Eigen::Vector3d centre_of_mass(const std::string& link, const std::map<std::string, double>& q) const;
  struct Mass {
    double kg = 0.0;
    Eigen::Vector3d p_L = Eigen::Vector3d::Zero();
  };
  [[nodiscard]] const std::map<std::string, Mass>& masses() const { return masses_; }

 private:
  struct Joint {
    std::string name, type, parent, child, mimic;
    double multiplier = 1.0, offset = 0.0;
    Eigen::Vector3d xyz = Eigen::Vector3d::Zero(), rpy = Eigen::Vector3d::Zero();
    Eigen::Vector3d axis = Eigen::Vector3d::UnitX();
  };
  std::map<std::string, Joint> joint_of_child_;
  std::map<std::string, Mass> masses_;
};

}  // namespace bodyschema
