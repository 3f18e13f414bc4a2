#include "bodyschema/effects/online_error_model.hpp"

#include <algorithm>

#include "bodyschema/observation/joint_motion.hpp"

namespace bodyschema {

OnlineErrorModel::OnlineErrorModel(std::shared_ptr<const RobotModel> robot, const RobotSetup& setup, ErrorModel model)
    : model_(std::move(model)), offsets_(model_.offsets()), instants_(robot, setup.hand_link, setup.gravity_W),
      whole_(robot->joint_count()) {
  for (std::size_t e = 0; e < model_.size(); ++e) {
    has_memory_ = has_memory_ || model_[e].has_memory();
    sags_ = sags_ || model_[e].follows_gravity();
    moves_ = moves_ || model_[e].follows_motion();
  }
  if (has_memory_ || moves_) samples_.resize(kKept + kMostWaiting);
}

void OnlineErrorModel::observe(const JointSample& sample) {
  if (samples_.empty()) return;
  if (count_ > seen_ && samples_[count_ - 1].utime == sample.utime) {
    samples_[count_ - 1] = sample;  // head and arm apart, with one stamp
    return;
  }
  if (count_ == samples_.size()) make_room();
  samples_[count_++] = sample;
}

/// Drops what no exposure needs any more; what waits too long is seen early.
void OnlineErrorModel::make_room() {
  if (seen_ <= kKept) {
    for (const std::size_t half = kKept + kMostWaiting / 2; seen_ < half; ++seen_) model_.observe(samples_[seen_]);
  }
  const std::size_t drop = seen_ - kKept;
  std::rotate(samples_.begin(), samples_.begin() + static_cast<std::ptrdiff_t>(drop), samples_.end());
  seen_ -= drop;
  count_ -= drop;
}

void OnlineErrorModel::show_until(Microseconds utime) {
  for (; seen_ < count_ && samples_[seen_].utime <= utime; ++seen_) model_.observe(samples_[seen_]);
}

void OnlineErrorModel::corrections(const JointSample& exposure, std::size_t camera, Corrections& out) {
  show_until(exposure.utime);
  instants_.build(exposure, camera, offsets_, at_);
  if (moves_) {
    joint_motion({samples_.data(), count_}, exposure.utime, at_.qdot, at_.qddot);
  }
  model_.corrections(at_, out, false);
  if (sags_) {
    // Gravity acts on the arm where it stands, sagged; the effects' other variables stay.
    model_.corrections(at_, whole_);
    before_ = at_;
    sag_ = -whole_.dq;
    instants_.build(exposure, camera, sag_, at_);
    at_.q = before_.q;
    at_.qdot = before_.qdot;
    at_.qddot = before_.qddot;
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
  seen_ = count_ = 0;
}

}  // namespace bodyschema
