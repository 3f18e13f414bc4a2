#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <memory>
#include <span>
#include <vector>

#include "bodyschema/camera/stereo_rig.hpp"
#include "bodyschema/effects/corrected_kinematics.hpp"
#include "bodyschema/estimator/parameter.hpp"
#include "bodyschema/observation/observation.hpp"
#include "bodyschema/robot/robot_model.hpp"
#include "bodyschema/robot/robot_setup.hpp"

namespace bodyschema {

/// From encoder readings and a state to where every rendered part is in every camera: the function
/// f(theta, x) of the paper without the drawing.
///
/// Camera and size parameters are folded into the part transforms, which then are affine rather
/// than rigid (a focal length changed by s scales camera x and y by 1 + s; a principal point moved
/// by d px shears x by d / f), so that one set of intrinsics serves all particles.
/// What an extended model knows about an exposure is added to the state; intrinsics are not looked
/// at there, they belong into the rig (ErrorModel::corrected).
/// One per thread; allocates nothing after construction.
class BodyPoseModel {
 public:
  /// Throws ConfigurationError when a link of the set-up or rig does not exist.
  BodyPoseModel(std::shared_ptr<const RobotModel> robot, const RobotSetup& setup, const StereoRig& rig,
                std::vector<Parameter> parameters);

  [[nodiscard]] std::span<const Parameter> parameters() const { return parameters_; }
  [[nodiscard]] std::size_t part_count() const { return part_count_; }
  [[nodiscard]] std::size_t camera_count() const { return rig_.cameras.size(); }

  /// @param at  encoder readings at the camera's exposure, and what is known beyond them
  /// @param x  state, one value per parameter
  /// @param X_CB  out, one transform per part
  void compute(const Exposure& at, const Eigen::VectorXd& x, std::size_t camera, std::span<Eigen::Isometry3f> X_CB);

  /// Pose of the hand base in a camera, metres, with the state's joint and vergence corrections
  /// (size and intrinsics corrections change the picture, not where the hand is).
  [[nodiscard]] Pose hand_pose(const Exposure& at, const Eigen::VectorXd& x, std::size_t camera);
  /// Positions of the fingertips in a camera, metres.
  void fingertips(const Exposure& at, const Eigen::VectorXd& x, std::size_t camera, std::vector<Eigen::Vector3d>& p_C);

 private:
  void evaluate(const Exposure& at, const Eigen::VectorXd& x, std::size_t camera);

  StereoRig rig_;
  std::vector<Parameter> parameters_;
  std::vector<Eigen::Index> finger_joints_;
  std::size_t part_count_ = 0;
  std::size_t fingertip_count_ = 0;
  CorrectedKinematics kinematics_;  ///< hand, fingertips, parts
  const Corrections nothing_;
  std::vector<Pose> X_CB_;  ///< of the camera last evaluated, as the next two
  Eigen::VectorXd q_;
  Eigen::Matrix3d image_warp_;  ///< focal and principal point changes
  double part_scale_ = 1.0;
};

}  // namespace bodyschema
