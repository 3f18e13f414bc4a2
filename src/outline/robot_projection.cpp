#include "bodyschema/outline/robot_projection.hpp"

namespace bodyschema {
namespace {

std::vector<std::string> placed_links(const RobotSetup& setup) {
  auto links = setup.model.rendered_links;
  links.push_back(setup.hand_link);
  links.insert(links.end(), setup.fingertip_links.begin(), setup.fingertip_links.end());
  return links;
}

std::vector<std::string> camera_links(const StereoRig& rig) {
  std::vector<std::string> links;
  for (const auto& camera : rig.cameras) links.push_back(camera.link);
  return links;
}

}  // namespace

RobotProjection::RobotProjection(std::shared_ptr<const RobotModel> robot, const RobotSetup& setup, const StereoRig& rig,
                                 const JointRoles& roles)
    : intrinsics_(rig.intrinsics()), segment_of_part_(setup.model.rendered_links.size(), 0),
      part_count_(setup.model.rendered_links.size()),
      kinematics_(std::move(robot), placed_links(setup), camera_links(rig)),
      X_CB_(part_count_ + 1 + setup.fingertip_links.size(), Pose::Identity()), scale_(roles.segments.size(), 1.0) {
  for (std::size_t s = 0; s < roles.segments.size(); ++s) {
    for (const auto part : roles.segments[s].parts) segment_of_part_[part] = s;
  }
}

void RobotProjection::place(const Eigen::Ref<const Eigen::VectorXd>& q, const Corrections& corrections,
                            std::size_t camera) {
  kinematics_.compute(q, corrections, camera, X_CB_);
  for (std::size_t s = 0; s < scale_.size(); ++s) scale_[s] = 1.0 + corrections.shapes[s].scale;
  const auto& k = intrinsics_[camera];
  warp_(0, 0) = warp_(1, 1) = 1.0 + corrections.camera.focal_scale;
  warp_(0, 2) = corrections.camera.cx_px / k.fx;
  warp_(1, 2) = corrections.camera.cy_px / k.fy;
}

void RobotProjection::parts(std::span<Eigen::Isometry3f> X_CB) const {
  for (std::size_t part = 0; part < part_count_; ++part) {
    const Pose& X = X_CB_[part];
    X_CB[part].linear() = (warp_ * X.linear() * scale_[segment_of_part_[part]]).cast<float>();
    X_CB[part].translation() = (warp_ * X.translation()).cast<float>();
    X_CB[part].makeAffine();
  }
}

SilhouetteModel silhouette_model(const RobotModel& robot, const RobotSetup& setup) {
  SilhouetteModel model;
  model.culling = setup.culling;
  for (const auto& mesh : robot.meshes()) model.parts.push_back(mesh.mesh);
  return model;
}

}  // namespace bodyschema
