#include "bodyschema/effects/online_error_model.hpp"

namespace bodyschema {

OnlineErrorModel::OnlineErrorModel(std::shared_ptr<const RobotModel> robot, const RobotSetup& setup,
                                   ErrorModel model)
    : model_(std::move(model)), offsets_(model_.offsets()),
      instants_(robot, setup.hand_link, setup.gravity_W), whole_(robot->joint_count()) {
  for (std::size_t e = 0; e < model_.size(); ++e) {
    has_memory_ = has_memory_ || model_[e].has_memory();
    sags_ = sags_ || model_[e].name() == "compliance" || model_[e].name() == "payload";
  }
  if (has_memory_) waiting_.resize(kMostWaiting);
}

void OnlineErrorModel::observe(const JointSample& sample) {
  if (!has_memory_) return;
  if (count_ == waiting_.size()) {
    model_.observe(waiting_[first_]);
    first_ = (first_ + 1) % waiting_.size();
    --count_;
  }
  waiting_[(first_ + count_++) % waiting_.size()] = sample;
}

void OnlineErrorModel::corrections(const JointSample& exposure, std::size_t camera,
                                   Corrections& out) {
  for (; count_ > 0 && waiting_[first_].utime <= exposure.utime; --count_) {
    model_.observe(waiting_[first_]);
    first_ = (first_ + 1) % waiting_.size();
  }
  instants_.build(exposure, camera, offsets_, at_);
  model_.corrections(at_, out, false);
  if (sags_) {
    // Gravity acts on the arm where it stands, sagged; the effects' other variables stay.
    model_.corrections(at_, whole_);
    q_ = at_.q;
    sag_ = -whole_.dq;
    instants_.build(exposure, camera, sag_, at_);
    at_.q = q_;
    model_.corrections(at_, out, false);
  }
  out.camera.focal_scale = out.camera.cx_px = out.camera.cy_px = out.camera.k1 = 0.0;
}

void OnlineErrorModel::annotate(CameraObservation& seen, std::size_t camera) {
  if (!seen.corrections) seen.corrections.emplace(seen.joints.q.size());
  corrections(seen.joints, camera, *seen.corrections);
}

void OnlineErrorModel::forget() {
  model_.forget();
  first_ = count_ = 0;
}

}  // namespace bodyschema
