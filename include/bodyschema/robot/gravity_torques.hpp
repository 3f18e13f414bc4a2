#pragma once

#include <Eigen/Core>
#include <memory>

#include "bodyschema/robot/robot_model.hpp"

namespace bodyschema {

/// Static torque that gravity exerts on each joint, by KDL's recursive Newton-Euler on the tree.
/// One per thread.
class GravityTorques {
 public:
  explicit GravityTorques(std::shared_ptr<const RobotModel> model);
  ~GravityTorques();
  GravityTorques(GravityTorques&&) noexcept;

  /// @param q  joint vector, radians
  /// @param gravity_W  acceleration of gravity in the root frame, m/s^2 (0 0 -9.81 for an upright robot)
  /// @return torque of gravity on each joint about its axis, Nm, RobotModel order. Positive torque
  ///         pushes the joint towards larger angles (minus the holding torque of the motor).
  Eigen::VectorXd compute(const Eigen::Ref<const Eigen::VectorXd>& q, const Eigen::Vector3d& gravity_W);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace bodyschema
