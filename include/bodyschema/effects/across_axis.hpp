#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <string>
#include <vector>

#include "bodyschema/effects/joint_roles.hpp"

namespace bodyschema {

/// The two directions across a joint's axis, along which axis_shift moves it (shift_1, shift_2) and about which
/// axis_tilt turns it (tilt_1, tilt_2; CorrectedKinematics::tilt_axis): for people, by the URDF's axes.
struct AcrossAxis {
  std::string joint;
  std::string link;                             ///< the URDF's, which carries the joint
  std::array<Eigen::Vector3d, 2> directions{};  ///< unit, in that link's axes
  /// "+y of the link r_upper_arm". @param positive  the direction itself, or the opposite one
  [[nodiscard]] std::string direction(std::size_t which, bool positive) const;
};

/// Of every joint of the arm, in the order of JointRoles::arm.
std::vector<AcrossAxis> across_axes(const std::shared_ptr<const RobotModel>& robot, const RobotSetup& setup,
                                    const JointRoles& roles);

}  // namespace bodyschema
