#include "bodyschema/effects/corrected_kinematics.hpp"

#include <algorithm>
#include <cmath>

namespace bodyschema {
namespace {

/// Across the axis and the coordinate axis it is least aligned with; of several the first, whatever rounding says,
/// so that an extended model means the same on every machine.
Eigen::Vector3d perpendicular(const Eigen::Vector3d& axis) {
  constexpr double kAlike = 1e-6;
  const Eigen::Vector3d aligned = axis.cwiseAbs();
  Eigen::Index first = 0;
  while (aligned[first] > aligned.minCoeff() + kAlike) ++first;
  return axis.cross(Eigen::Vector3d::Unit(first)).normalized();
}

/// Moved along and turned about the axes of a frame.
Pose small_motion(const Eigen::Vector3d& shift_m, const Eigen::Vector3d& turn_rad) {
  Pose X = Pose::Identity();
  X.translation() = shift_m;
  if (const double angle = turn_rad.norm(); angle > 0.0) {
    X.linear() = Eigen::AngleAxisd(angle, turn_rad / angle).toRotationMatrix();
  }
  return X;
}

}  // namespace

CorrectedKinematics::CorrectedKinematics(std::shared_ptr<const RobotModel> model, std::vector<std::string> links,
                                         std::vector<std::string> camera_links)
    : model_(std::move(model)), link_count_(links.size()), camera_count_(camera_links.size()) {
  auto all = std::move(links);
  all.insert(all.end(), camera_links.begin(), camera_links.end());
  const auto joints = model_->joints();
  joints_.resize(joints.size());
  // Legs and the other arm cost nothing: only joints that matter get their parents evaluated.
  const ForwardKinematics listed(model_, all);
  const std::size_t listed_count = all.size();
  for (std::size_t j = 0; j < joints.size(); ++j) {
    for (std::size_t l = 0; l < listed_count; ++l) {
      joints_[j].moves_something |= listed.moves(static_cast<Eigen::Index>(j), l);
    }
    if (!joints_[j].moves_something) continue;
    const auto position = [&](const std::string& link) {
      const auto at =
          std::find(all.begin() + static_cast<std::ptrdiff_t>(link_count_ + camera_count_), all.end(), link);
      const auto index = static_cast<std::size_t>(at - all.begin());
      if (at == all.end()) all.push_back(link);
      return index;
    };
    joints_[j].parent = position(joints[j].parent_link);
    joints_[j].child = position(joints[j].child_link);
  }
  fk_ = std::make_unique<ForwardKinematics>(model_, all);
  X_W_.resize(all.size(), Pose::Identity());
  q_.setZero(model_->joint_count());
  fk_->compute(q_, X_W_);
  moves_.resize(joints.size() * all.size());
  carries_.resize(moves_.size());
  for (std::size_t j = 0; j < joints.size(); ++j) {
    if (!joints_[j].moves_something) continue;
    const auto axis = fk_->joint_axis(static_cast<Eigen::Index>(j));
    const Eigen::Vector3d axis_P = X_W_[joints_[j].parent].linear().transpose() * axis.direction_W;
    joints_[j].tilt_P[0] = perpendicular(axis_P);
    joints_[j].tilt_P[1] = axis_P.cross(joints_[j].tilt_P[0]).normalized();
    // The next joint may hang on a link that is fixed to this joint's.
    for (std::size_t k = 0; k < joints.size(); ++k) {
      if (!joints_[k].moves_something || !fk_->moves(static_cast<Eigen::Index>(j), joints_[k].parent)) continue;
      const Eigen::Vector3d on = fk_->joint_axis(static_cast<Eigen::Index>(k)).point_W - axis.point_W;
      const double along = axis.direction_W.dot(on);
      if (std::abs(along) < 1e-6) continue;
      joints_[j].outwards = along > 0.0 ? 1.0 : -1.0;
      break;
    }
    for (std::size_t l = 0; l < all.size(); ++l) {
      moves_[j * all.size() + l] = fk_->moves(static_cast<Eigen::Index>(j), l);
      carries_[j * all.size() + l] = moves_[j * all.size() + l] && all[l] != joints[j].child_link;
    }
  }
}

void CorrectedKinematics::compute(const Eigen::Ref<const Eigen::VectorXd>& q, const Corrections& corrections,
                                  std::size_t camera, std::span<Pose> X_CB) {
  q_ = q + corrections.dq;
  fk_->compute(q_, X_W_);
  X_WC_ = X_W_[link_count_ + camera];
  const bool rig_moves = !corrections.camera.rig_shift_m.isZero(0.0) || !corrections.camera.rig_turn_rad.isZero(0.0);
  Pose X_WF = X_W_[link_count_];  // of the rig's first camera
  std::copy_n(X_W_.begin(), link_count_, X_CB.begin());
  // Tip first: each C uses plain frames, so the product builds up from the right.
  for (auto j = joints_.size(); j-- > 0;) {
    const auto& adjustment = corrections.adjustments[j];
    if (!joints_[j].moves_something) continue;
    const auto joint = static_cast<Eigen::Index>(j);
    if (adjustment.mounts()) {
      mount(joint, camera, adjustment, X_CB);
      if (rig_moves && carries_[j * X_W_.size() + link_count_]) X_WF = mount_C_ * X_WF;
    }
    if (adjustment.is_zero()) continue;
    const auto axis = fk_->joint_axis(joint);
    const Eigen::Vector3d tilt =
        adjustment.tilt_1_rad * tilt_axis(joint, 0) + adjustment.tilt_2_rad * tilt_axis(joint, 1);
    Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
    if (const double angle = tilt.norm(); angle > 0.0) {
      const Eigen::Matrix3d R_tilt = Eigen::AngleAxisd(angle, tilt / angle).toRotationMatrix();
      const Eigen::Matrix3d R_joint = Eigen::AngleAxisd(q_[joint], axis.direction_W).toRotationMatrix();
      R = R_tilt * R_joint * R_tilt.transpose() * R_joint.transpose();
    }
    Pose C = Pose::Identity();
    C.linear() = R;
    C.translation() = axis.point_W - R * axis.point_W + joints_[j].outwards * adjustment.along_m * axis.direction_W +
                      adjustment.shift_1_m * tilt_axis(joint, 0) + adjustment.shift_2_m * tilt_axis(joint, 1);
    for (std::size_t l = 0; l < link_count_; ++l) {
      if (moves(joint, l)) X_CB[l] = C * X_CB[l];
    }
    if (moves(joint, link_count_ + camera)) X_WC_ = C * X_WC_;
    if (rig_moves && moves(joint, link_count_)) X_WF = C * X_WF;
  }
  if (rig_moves) {
    const Pose X_FC = X_WF.inverse(Eigen::Isometry) * X_WC_;
    X_WC_ = X_WF * small_motion(corrections.camera.rig_shift_m, corrections.camera.rig_turn_rad) * X_FC;
  }
  X_WC_ = X_WC_ * small_motion(corrections.camera.shift_m, corrections.camera.turn_rad);
  X_WC_.pretranslate(-corrections.base_shift_m);
  const Pose X_CW = X_WC_.inverse(Eigen::Isometry);
  for (auto& X : X_CB.first(link_count_)) X = X_CW * X;
}

void CorrectedKinematics::mount(Eigen::Index joint, std::size_t camera, const JointAdjustment& adjustment,
                                std::span<Pose> X_WB) {
  const Pose& X_WL = X_W_[joints_[static_cast<std::size_t>(joint)].child];
  mount_C_ = X_WL * small_motion(adjustment.mount_shift_m, adjustment.mount_turn_rad) * X_WL.inverse(Eigen::Isometry);
  const auto first = static_cast<std::size_t>(joint) * X_W_.size();
  for (std::size_t l = 0; l < link_count_; ++l) {
    if (carries_[first + l]) X_WB[l] = mount_C_ * X_WB[l];
  }
  if (carries_[first + link_count_ + camera]) X_WC_ = mount_C_ * X_WC_;
}

Eigen::Vector3d CorrectedKinematics::tilt_axis(Eigen::Index joint, int which) const {
  const auto& frames = joints_[static_cast<std::size_t>(joint)];
  if (!frames.moves_something) return Eigen::Vector3d::Zero();
  return X_W_[frames.parent].linear() * frames.tilt_P[static_cast<std::size_t>(which)];
}

Eigen::Vector3d CorrectedKinematics::shift_axis(Eigen::Index joint, int which) const {
  const auto& frames = joints_[static_cast<std::size_t>(joint)];
  if (!frames.moves_something) return Eigen::Vector3d::Zero();
  return which == 0 ? Eigen::Vector3d(frames.outwards * fk_->joint_axis(joint).direction_W)
                    : tilt_axis(joint, which - 1);
}

bool CorrectedKinematics::moves(Eigen::Index joint, std::size_t link) const {
  return moves_[static_cast<std::size_t>(joint) * X_W_.size() + link];
}

}  // namespace bodyschema
