#pragma once

#include <Eigen/Core>
#include <memory>

#include "bodyschema/robot/robot_model.hpp"

namespace bodyschema {

/// Static torque that gravity exerts on each joint: the axis times the moment of the weight of
/// everything that hangs on it, summed over the tree from the leaves (KDL segments; the static part
/// of recursive Newton-Euler). A driver also feels its mimic joints, each times its multiplier.
/// One per thread; allocates nothing after construction.
class GravityTorques {
 public:
  explicit GravityTorques(std::shared_ptr<const RobotModel> model);
  ~GravityTorques();
  GravityTorques(GravityTorques&&) noexcept;

  /// @param q  joint vector, radians
  /// @param gravity_W  acceleration of gravity in the root frame, m/s^2 (upright robot: 0 0 -9.81)
  /// @return torque of gravity on each joint about its axis, Nm, RobotModel order. Positive torque
  ///         pushes the joint towards larger angles (minus the holding torque of the motor); N for
  ///         prismatic joints. Valid until the next call.
  const Eigen::VectorXd& compute(const Eigen::Ref<const Eigen::VectorXd>& q, const Eigen::Vector3d& gravity_W);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace bodyschema
