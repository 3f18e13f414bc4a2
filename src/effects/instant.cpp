#include "bodyschema/effects/instant.hpp"

#include <algorithm>
#include <cmath>

#include "bodyschema/observation/joint_motion.hpp"

namespace bodyschema {
namespace {

/// Adds `share` times where each joint is so much later, against where it is at the instant.
void add_motion(const Instant& at, double after_s, double share, Eigen::VectorXd& dq) {
  if (after_s == 0.0) return;
  const Eigen::MatrixXd& path = at.path;
  const double place = after_s / kPathStep_s + static_cast<double>(kPathSteps);
  const bool within = path.cols() == 2 * kPathSteps + 1 && place >= 0.0 && place <= 2.0 * kPathSteps;
  // The cubic through four points of the path.
  const auto first =
      std::clamp<Eigen::Index>(static_cast<Eigen::Index>(std::floor(within ? place : 0.0)) - 1, 0, 2 * kPathSteps - 3);
  const double t = place - static_cast<double>(first);
  const double weight[] = {-(t - 1.0) * (t - 2.0) * (t - 3.0) / 6.0, t * (t - 2.0) * (t - 3.0) / 2.0,
                           -t * (t - 1.0) * (t - 3.0) / 2.0, t * (t - 1.0) * (t - 2.0) / 6.0};
  for (Eigen::Index j = 0; j < dq.size(); ++j) {
    double moved = std::nan("");
    if (within && j < path.rows()) {
      moved = 0.0;
      for (Eigen::Index k = 0; k < 4; ++k) moved += weight[k] * path(j, first + k);
    }
    dq[j] += share * (std::isfinite(moved) ? moved : after_s * at.qdot[j] + 0.5 * after_s * after_s * at.qddot[j]);
  }
}

}  // namespace

Instant Instant::at_rest(const Eigen::VectorXd& q, std::size_t camera) {
  Instant at;
  at.camera = camera;
  at.encoder = at.q = q;
  at.qdot = at.qddot = Eigen::VectorXd::Zero(q.size());
  return at;
}

void Instant::show_later(double after_s, Corrections& c) const {
  add_motion(*this, c.later_s, -1.0, c.dq);
  c.later_s += after_s;
  add_motion(*this, c.later_s, 1.0, c.dq);
}

InstantBuilder::InstantBuilder(std::shared_ptr<const RobotModel> model, const std::string& hand_link,
                               const Eigen::Vector3d& gravity_W)
    : model_(std::move(model)), gravity_W_(gravity_W), torques_(model_) {
  if (!hand_link.empty()) {
    hand_ = std::make_unique<ForwardKinematics>(model_, std::vector<std::string>{hand_link});
  }
}

void InstantBuilder::build(const JointSample& sample, std::size_t camera,
                           const Eigen::Ref<const Eigen::VectorXd>& offsets, Instant& out) {
  out.utime = sample.utime;
  out.camera = camera;
  out.encoder = sample.q;
  out.q = sample.q - offsets;
  out.qdot = sample.qdot;
  out.qddot.setZero(sample.q.size());
  if (model_->has_masses()) out.gravity_torque = torques_.compute(out.q, gravity_W_);
  if (hand_) {
    Pose X_WP;
    hand_->compute(out.q, std::span<Pose>(&X_WP, 1));
    out.payload_torque.setZero(out.q.size());
    for (Eigen::Index j = 0; j < out.q.size(); ++j) {
      if (!hand_->moves(j, 0)) continue;
      const auto axis = hand_->joint_axis(j);
      const Eigen::Vector3d arm = X_WP.translation() - axis.point_W;
      out.payload_torque[j] = axis.direction_W.dot(arm.cross(gravity_W_));
    }
  }
}

}  // namespace bodyschema
