#include "bodyschema/estimator/body_pose_model.hpp"

#include "bodyschema/effects/effect.hpp"

namespace bodyschema {
namespace {

std::vector<std::string> evaluated_links(const RobotSetup& setup, const StereoRig& rig) {
  std::vector<std::string> links;
  for (const auto& camera : rig.cameras) links.push_back(camera.link);
  links.push_back(setup.hand_link);
  links.insert(links.end(), setup.fingertip_links.begin(), setup.fingertip_links.end());
  links.insert(links.end(), setup.model.rendered_links.begin(), setup.model.rendered_links.end());
  return links;
}

}  // namespace

BodyPoseModel::BodyPoseModel(std::shared_ptr<const RobotModel> robot, const RobotSetup& setup,
                             const StereoRig& rig, std::vector<Parameter> parameters)
    : robot_(std::move(robot)), rig_(rig), parameters_(std::move(parameters)),
      part_count_(setup.model.rendered_links.size()),
      fingertip_count_(setup.fingertip_links.size()),
      kinematics_(robot_, evaluated_links(setup, rig)),
      X_WB_(rig.cameras.size() + 1 + fingertip_count_ + part_count_) {
  finger_joints_ = JointRoles::of(robot_, setup).fingers;
  q_true_.resize(robot_->joint_count());
}

Eigen::VectorXd BodyPoseModel::corrected_joints(const Eigen::VectorXd& q,
                                                const Eigen::VectorXd& x) const {
  Eigen::VectorXd corrected = q;
  for (std::size_t k = 0; k < parameters_.size(); ++k) {
    const Parameter& parameter = parameters_[k];
    const double value = x(static_cast<Eigen::Index>(k));
    if (parameter.kind == ParameterKind::kJointOffset) {
      corrected(parameter.joint) -= value;
    } else if (parameter.kind == ParameterKind::kFingerCurl) {
      for (const Eigen::Index joint : finger_joints_) corrected(joint) += value;
    }
  }
  return corrected;
}

void BodyPoseModel::evaluate(const Eigen::VectorXd& q, const Eigen::VectorXd& x,
                             std::size_t camera) {
  q_true_ = q;
  double vergence = 0.0;
  double focal_scale = 0.0;
  Eigen::Vector2d principal_difference_px = Eigen::Vector2d::Zero();
  part_scale_ = 1.0;
  for (std::size_t k = 0; k < parameters_.size(); ++k) {
    const Parameter& parameter = parameters_[k];
    const double value = x(static_cast<Eigen::Index>(k));
    switch (parameter.kind) {
      case ParameterKind::kJointOffset: q_true_(parameter.joint) -= value; break;
      case ParameterKind::kFingerCurl:
        for (const Eigen::Index joint : finger_joints_) q_true_(joint) += value;
        break;
      case ParameterKind::kVergence: vergence = value; break;
      case ParameterKind::kFocalScale: focal_scale = value; break;
      case ParameterKind::kPrincipalDifferenceX: principal_difference_px.x() = value; break;
      case ParameterKind::kPrincipalDifferenceY: principal_difference_px.y() = value; break;
      case ParameterKind::kMeshScale: part_scale_ = 1.0 + value; break;
      case ParameterKind::kDilation: break;
    }
  }
  kinematics_.compute(q_true_, X_WB_);
  X_CW_ = X_WB_[camera].inverse();
  if (camera == 1 && vergence != 0.0) {
    X_CW_ = Eigen::AngleAxisd(vergence, Eigen::Vector3d::UnitY()) * X_CW_;
  }
  image_warp_.setIdentity();
  image_warp_(0, 0) = image_warp_(1, 1) = 1.0 + focal_scale;
  const double sign = camera == 0 ? -0.5 : 0.5;
  const PinholeIntrinsics& intrinsics = rig_.cameras[camera].intrinsics;
  image_warp_(0, 2) = sign * principal_difference_px.x() / intrinsics.fx;
  image_warp_(1, 2) = sign * principal_difference_px.y() / intrinsics.fy;
}

void BodyPoseModel::compute(const Eigen::VectorXd& q, const Eigen::VectorXd& x,
                            std::size_t camera, std::span<Eigen::Isometry3f> X_CB) {
  evaluate(q, x, camera);
  const std::size_t first = rig_.cameras.size() + 1 + fingertip_count_;
  for (std::size_t part = 0; part < part_count_; ++part) {
    const Pose X = X_CW_ * X_WB_[first + part];
    X_CB[part].linear() = (image_warp_ * X.linear() * part_scale_).cast<float>();
    X_CB[part].translation() = (image_warp_ * X.translation()).cast<float>();
    X_CB[part].makeAffine();
  }
}

Pose BodyPoseModel::hand_pose(const Eigen::VectorXd& q, const Eigen::VectorXd& x,
                              std::size_t camera) {
  evaluate(q, x, camera);
  return X_CW_ * X_WB_[rig_.cameras.size()];
}

void BodyPoseModel::fingertips(const Eigen::VectorXd& q, const Eigen::VectorXd& x,
                               std::size_t camera, std::vector<Eigen::Vector3d>& p_C) {
  evaluate(q, x, camera);
  p_C.clear();
  for (std::size_t tip = 0; tip < fingertip_count_; ++tip) {
    p_C.push_back((X_CW_ * X_WB_[rig_.cameras.size() + 1 + tip]).translation());
  }
}

}  // namespace bodyschema
