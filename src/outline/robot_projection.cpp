#include "bodyschema/outline/robot_projection.hpp"

namespace bodyschema {
namespace {

std::vector<std::string> placed_links(const RobotSetup& setup) {
  auto links = setup.model.rendered_links;
  links.push_back(setup.hand_link);
  links.insert(links.end(), setup.fingertip_links.begin(), setup.fingertip_links.end());
  return links;
}

}  // namespace

RobotProjection::RobotProjection(std::shared_ptr<const RobotModel> robot, const RobotSetup& setup, const StereoRig& rig,
                                 const JointRoles& roles)
    : intrinsics_(rig.intrinsics()), segment_of_part_(setup.model.rendered_links.size(), 0),
      core_of_part_(segment_of_part_.size(), kNone), part_count_(setup.model.rendered_links.size()),
      kinematics_(std::move(robot), placed_links(setup), rig.links()),
      X_CB_(part_count_ + 1 + setup.fingertip_links.size(), Pose::Identity()), shapes_(roles.segments.size()) {
  for (std::size_t s = 0; s < roles.segments.size(); ++s) {
    const auto& segment = roles.segments[s];
    for (const auto part : segment.parts) segment_of_part_[part] = s;
    for (const auto part : segment.inner) core_of_part_[part] = segment.core;
    if (!segment.inner.empty()) core_of_part_[segment.core] = segment.core;
  }
}

void RobotProjection::place(const Eigen::Ref<const Eigen::VectorXd>& q, const Corrections& corrections,
                            std::size_t camera) {
  kinematics_.compute(q, corrections, camera, X_CB_);
  shapes_ = corrections.shapes;
  const auto& k = intrinsics_[camera];
  warp_(0, 0) = warp_(1, 1) = 1.0 + corrections.camera.focal_scale;
  warp_(0, 2) = corrections.camera.cx_px / (k.reduction * k.fx);
  warp_(1, 2) = corrections.camera.cy_px / (k.reduction * k.fy);
}

void RobotProjection::parts(std::span<Eigen::Isometry3f> X_CB) const {
  for (std::size_t part = 0; part < part_count_; ++part) {
    X_CB[part].linear() = (warp_ * X_CB_[part].linear() * scale(part)).cast<float>();
    X_CB[part].translation() = (warp_ * origin(part)).cast<float>();
    X_CB[part].makeAffine();
  }
}

double RobotProjection::size(std::size_t part) const {
  return core_of_part_[part] == kNone ? 0.0 : shapes_[segment_of_part_[part]].size;
}

double RobotProjection::scale(std::size_t part) const {
  return (1.0 + shapes_[segment_of_part_[part]].scale) * (1.0 + size(part));
}

Eigen::Vector3d RobotProjection::from_core(std::size_t part) const {
  if (core_of_part_[part] == kNone) return Eigen::Vector3d::Zero();
  return X_CB_[part].translation() - X_CB_[core_of_part_[part]].translation();
}

Eigen::Vector3d RobotProjection::origin(std::size_t part) const {
  return X_CB_[part].translation() + size(part) * from_core(part);
}

SilhouetteModel silhouette_model(const RobotModel& robot, const RobotSetup& setup) {
  SilhouetteModel model;
  model.culling = setup.culling;
  for (const auto& mesh : robot.meshes()) model.parts.push_back(mesh.mesh);
  return model;
}

}  // namespace bodyschema
