#include "bodyschema/estimator/body_pose_model.hpp"

#include "bodyschema/effects/effect.hpp"

namespace bodyschema {
namespace {

std::vector<std::string> evaluated_links(const RobotSetup& setup) {
  std::vector<std::string> links = {setup.hand_link};
  links.insert(links.end(), setup.fingertip_links.begin(), setup.fingertip_links.end());
  links.insert(links.end(), setup.model.rendered_links.begin(), setup.model.rendered_links.end());
  return links;
}

std::vector<std::string> camera_links(const StereoRig& rig) {
  std::vector<std::string> links;
  for (const auto& camera : rig.cameras) links.push_back(camera.link);
  return links;
}

}  // namespace

BodyPoseModel::BodyPoseModel(std::shared_ptr<const RobotModel> robot, const RobotSetup& setup, const StereoRig& rig,
                             std::vector<Parameter> parameters)
    : rig_(rig), parameters_(std::move(parameters)), finger_joints_(JointRoles::of(robot, setup, rig).fingers),
      part_count_(setup.model.rendered_links.size()), fingertip_count_(setup.fingertip_links.size()),
      kinematics_(robot, evaluated_links(setup), camera_links(rig)), nothing_(robot->joint_count()),
      X_CB_(1 + fingertip_count_ + part_count_), q_(robot->joint_count()) {}

void BodyPoseModel::evaluate(const Exposure& at, const Eigen::VectorXd& x, std::size_t camera) {
  const Corrections& known = at.corrections != nullptr ? *at.corrections : nothing_;
  q_ = at.q;
  double vergence = 0.0;
  double focal_scale = 0.0;
  Eigen::Vector2d principal_difference_px = Eigen::Vector2d::Zero();
  part_scale_ = 1.0 + known.mesh_scale;
  for (std::size_t k = 0; k < parameters_.size(); ++k) {
    const Parameter& parameter = parameters_[k];
    const double value = x(static_cast<Eigen::Index>(k));
    switch (parameter.kind) {
      case ParameterKind::kJointOffset: q_(parameter.joint) -= value; break;
      case ParameterKind::kFingerCurl:
        for (const Eigen::Index joint : finger_joints_) q_(joint) += value;
        break;
      case ParameterKind::kVergence: vergence = value; break;
      case ParameterKind::kFocalScale: focal_scale = value; break;
      case ParameterKind::kPrincipalDifferenceX: principal_difference_px.x() = value; break;
      case ParameterKind::kPrincipalDifferenceY: principal_difference_px.y() = value; break;
      case ParameterKind::kMeshScale: part_scale_ *= 1.0 + value; break;
      case ParameterKind::kDilation: break;
    }
  }
  kinematics_.compute(q_, known, camera, X_CB_);
  if (camera == 1 && vergence != 0.0) {
    const Pose turned(Eigen::AngleAxisd(vergence, Eigen::Vector3d::UnitY()));
    for (auto& X : X_CB_) X = turned * X;
  }
  image_warp_.setIdentity();
  image_warp_(0, 0) = image_warp_(1, 1) = 1.0 + focal_scale;
  const double sign = camera == 0 ? -0.5 : 0.5;
  const PinholeIntrinsics& intrinsics = rig_.cameras[camera].intrinsics;
  image_warp_(0, 2) = sign * principal_difference_px.x() / intrinsics.fx;
  image_warp_(1, 2) = sign * principal_difference_px.y() / intrinsics.fy;
}

void BodyPoseModel::compute(const Exposure& at, const Eigen::VectorXd& x, std::size_t camera,
                            std::span<Eigen::Isometry3f> X_CB) {
  evaluate(at, x, camera);
  const std::size_t first = 1 + fingertip_count_;
  for (std::size_t part = 0; part < part_count_; ++part) {
    const Pose& X = X_CB_[first + part];
    X_CB[part].linear() = (image_warp_ * X.linear() * part_scale_).cast<float>();
    X_CB[part].translation() = (image_warp_ * X.translation()).cast<float>();
    X_CB[part].makeAffine();
  }
}

Pose BodyPoseModel::hand_pose(const Exposure& at, const Eigen::VectorXd& x, std::size_t camera) {
  evaluate(at, x, camera);
  return X_CB_.front();
}

void BodyPoseModel::fingertips(const Exposure& at, const Eigen::VectorXd& x, std::size_t camera,
                               std::vector<Eigen::Vector3d>& p_C) {
  evaluate(at, x, camera);
  p_C.clear();
  for (std::size_t tip = 0; tip < fingertip_count_; ++tip) p_C.push_back(X_CB_[1 + tip].translation());
}

}  // namespace bodyschema
