#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <memory>
#include <span>
#include <vector>

#include "bodyschema/camera/stereo_rig.hpp"
#include "bodyschema/effects/corrected_kinematics.hpp"
#include "bodyschema/effects/joint_roles.hpp"
#include "bodyschema/silhouette/silhouette_scorer.hpp"

namespace bodyschema {

/// From encoder readings and corrections to where every rendered part is in a camera: the function f(theta, x) of the
/// paper without the drawing.
///
/// Corrections of cameras and sizes are folded into the parts' transforms, which then are affine rather than rigid (a
/// focal length changed by s scales camera x and y by 1 + s; a principal point moved by d px shears x by d / f), so
/// that one set of intrinsics serves all predictions. Distortion is no such thing: outlines are bent afterwards. One
/// per thread; allocates nothing after construction.
class RobotProjection {
 public:
  /// Throws ConfigurationError when a link of the set-up or rig does not exist.
  RobotProjection(std::shared_ptr<const RobotModel> robot, const RobotSetup& setup, const StereoRig& rig,
                  const JointRoles& roles);

  /// Places the robot; what follows is about this view.
  /// @param q  encoder readings, radians, RobotModel order
  void place(const Eigen::Ref<const Eigen::VectorXd>& q, const Corrections& corrections, std::size_t camera);
  /// Transforms of the parts for drawing, metres; one per part.
  void parts(std::span<Eigen::Isometry3f> X_CB) const;
  /// Poses of the parts as the URDF has their places to each other, of the hand's frame and of the fingertips in the
  /// camera, metres.
  [[nodiscard]] std::span<const Pose> links() const { return X_CB_; }
  /// Of a part whose segment is of another size: where its frame's origin lies in the camera, m.
  [[nodiscard]] Eigen::Vector3d origin(std::size_t part) const;
  /// From the origin of its segment's core to its own as in the URDF, in the camera, m; zero where it has none.
  [[nodiscard]] Eigen::Vector3d from_core(std::size_t part) const;
  /// By which a part's mesh is scaled, all in all; and Corrections' `size` where it is a part's.
  [[nodiscard]] double scale(std::size_t part) const;
  [[nodiscard]] double size(std::size_t part) const;
  [[nodiscard]] const Pose& hand() const { return X_CB_[part_count_]; }
  [[nodiscard]] std::size_t hand_link() const { return part_count_; }
  [[nodiscard]] std::span<const Pose> fingertips() const { return std::span(X_CB_).subspan(part_count_ + 1); }
  /// What `parts` does to a point of the camera's frame before it is drawn with the rig's intrinsics.
  [[nodiscard]] const Eigen::Matrix3d& warp() const { return warp_; }

  [[nodiscard]] std::size_t part_count() const { return part_count_; }
  [[nodiscard]] std::size_t camera_count() const { return intrinsics_.size(); }
  [[nodiscard]] const PinholeIntrinsics& intrinsics(std::size_t camera) const { return intrinsics_[camera]; }
  [[nodiscard]] std::size_t segment_of(std::size_t part) const { return segment_of_part_[part]; }
  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);
  /// The part from which another size of the segment is measured; kNone: it keeps its size.
  [[nodiscard]] std::size_t core_of(std::size_t part) const { return core_of_part_[part]; }

 private:
  std::vector<PinholeIntrinsics> intrinsics_;
  std::vector<std::size_t> segment_of_part_;
  std::vector<std::size_t> core_of_part_;
  std::size_t part_count_;
  CorrectedKinematics kinematics_;  ///< parts, hand, fingertips
  std::vector<Pose> X_CB_;
  std::vector<ShapeCorrection> shapes_;  ///< per segment
  Eigen::Matrix3d warp_ = Eigen::Matrix3d::Identity();
};

/// The rendered links' meshes, as scorer and outlines want them.
SilhouetteModel silhouette_model(const RobotModel& robot, const RobotSetup& setup);

}  // namespace bodyschema
