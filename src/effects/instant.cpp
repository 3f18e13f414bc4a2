#include "bodyschema/effects/instant.hpp"

namespace bodyschema {

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
