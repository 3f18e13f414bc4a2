#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <memory>
#include <span>
#include <vector>

#include "bodyschema/camera/stereo_rig.hpp"
#include "bodyschema/estimator/parameter.hpp"
#include "bodyschema/robot/forward_kinematics.hpp"
#include "bodyschema/robot/robot_model.hpp"
#include "bodyschema/robot/robot_setup.hpp"

namespace bodyschema {

/// From encoder readings and a state to where every rendered part is in every camera: the function
/// f(theta, x) of the paper without the drawing.
///
/// Camera and size parameters are folded into the part transforms, which then are affine rather
/// than rigid (a focal length changed by s scales camera x and y by 1 + s; a principal point moved
/// by d px shears x by d / f), so that one set of intrinsics serves all particles.
/// One per thread; allocates nothing after construction.
class BodyPoseModel {
 public:
  /// Throws ConfigurationError when a link of the set-up or rig does not exist.
  BodyPoseModel(std::shared_ptr<const RobotModel> robot, const RobotSetup& setup,
                const StereoRig& rig, std::vector<Parameter> parameters);

  [[nodiscard]] std::span<const Parameter> parameters() const { return parameters_; }
  [[nodiscard]] std::size_t part_count() const { return part_count_; }
  [[nodiscard]] std::size_t camera_count() const { return rig_.cameras.size(); }

  /// @param q  encoder readings at the camera's exposure, RobotModel order, radians
  /// @param x  state, one value per parameter
  /// @param X_CB  out, one transform per part
  void compute(const Eigen::VectorXd& q, const Eigen::VectorXd& x, std::size_t camera,
               std::span<Eigen::Isometry3f> X_CB);

  /// Pose of the hand base in a camera, metres, with the state's joint and vergence corrections
  /// (size and intrinsics corrections change the picture, not where the hand is).
  [[nodiscard]] Pose hand_pose(const Eigen::VectorXd& q, const Eigen::VectorXd& x,
                               std::size_t camera);
  /// Positions of the fingertips in a camera, metres.
  void fingertips(const Eigen::VectorXd& q, const Eigen::VectorXd& x, std::size_t camera,
                  std::vector<Eigen::Vector3d>& p_C);
  /// Encoder readings with the state's joint corrections taken off: q_true.
  [[nodiscard]] Eigen::VectorXd corrected_joints(const Eigen::VectorXd& q,
                                                 const Eigen::VectorXd& x) const;

 private:
  void evaluate(const Eigen::VectorXd& q, const Eigen::VectorXd& x, std::size_t camera);

  std::shared_ptr<const RobotModel> robot_;
  StereoRig rig_;
  std::vector<Parameter> parameters_;
  std::vector<Eigen::Index> finger_joints_;
  std::size_t part_count_ = 0;
  std::size_t fingertip_count_ = 0;
  ForwardKinematics kinematics_;  ///< cameras, hand, fingertips, parts
  std::vector<Pose> X_WB_;
  Eigen::VectorXd q_true_;
  Eigen::Matrix3d image_warp_;  ///< of the camera last evaluated: focal and principal point changes
  Pose X_CW_;
  double part_scale_ = 1.0;
};

}  // namespace bodyschema
