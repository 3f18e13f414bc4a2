#pragma once

#include <Eigen/Core>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "bodyschema/geometry/pose.hpp"
#include "bodyschema/robot/robot_model.hpp"

namespace bodyschema {

/// Poses of a chosen set of links in the root frame, by KDL. Only the joints between those links
/// and the root are evaluated. One per thread; allocates nothing after construction. The joint axes
/// are for Jacobians: a link point p moves by direction x (p - point) per radian.
class ForwardKinematics {
 public:
  /// Throws ConfigurationError naming an unknown link and the nearest one.
  ForwardKinematics(std::shared_ptr<const RobotModel> model, std::vector<std::string> links);
  ~ForwardKinematics();
  ForwardKinematics(ForwardKinematics&&) noexcept;

  /// @param q  joint vector in RobotModel order, radians
  /// @param X_WB  out, one pose per link, in the order given to the constructor
  void compute(const Eigen::Ref<const Eigen::VectorXd>& q, std::span<Pose> X_WB);

  /// The axis of a joint at the last `compute`: unit direction and a point on it in the root frame,
  /// metres. For a driver with mimic joints this is the driver's own axis. Zero direction for a
  /// joint that moves none of the links.
  struct Axis {
    Eigen::Vector3d direction_W;
    Eigen::Vector3d point_W;
  };
  [[nodiscard]] Axis joint_axis(Eigen::Index joint) const;
  /// Whether the joint (or a mimic of it) moves link number `link` of the constructor's list.
  [[nodiscard]] bool moves(Eigen::Index joint, std::size_t link) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace bodyschema
