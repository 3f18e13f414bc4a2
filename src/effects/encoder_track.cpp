#include "bodyschema/effects/encoder_track.hpp"

#include <algorithm>

#include "bodyschema/observation/joint_motion.hpp"

namespace bodyschema {
namespace {

/// For the motion about an exposure: a quarter of a second at 1 kHz.
constexpr std::size_t kKept = 256;

}  // namespace

EncoderTrack::EncoderTrack(std::shared_ptr<const RobotModel> robot, const RobotSetup& setup)
    : instants_(std::move(robot), setup.hand_link, setup.gravity_W) {}

void EncoderTrack::add(std::span<const JointSample> samples) {
  if (shown_ > 2 * kKept) {
    samples_.erase(samples_.begin(), samples_.begin() + static_cast<std::ptrdiff_t>(shown_ - kKept));
    shown_ = kKept;
  }
  for (const auto& sample : samples) {
    if (!samples_.empty() && samples_.back().utime == sample.utime) {
      samples_.back() = sample;
      shown_ = std::min(shown_, samples_.size() - 1);  // what it says now is to be shown as well
    } else {
      samples_.push_back(sample);
    }
  }
}

void EncoderTrack::forget() {
  samples_.clear();
  shown_ = 0;
}

void EncoderTrack::instant(const JointSample& exposure, std::size_t camera,
                           const Eigen::Ref<const Eigen::VectorXd>& offsets, Instant& out) {
  instants_.build(exposure, camera, offsets, out);
  joint_motion(samples_, exposure.utime, out.qdot, out.qddot);
}

void EncoderTrack::torques_at(const JointSample& exposure, const Eigen::Ref<const Eigen::VectorXd>& offsets,
                              Instant& out) {
  instants_.build(exposure, out.camera, offsets, elsewhere_);
  out.gravity_torque = elsewhere_.gravity_torque;
  out.payload_torque = elsewhere_.payload_torque;
}

}  // namespace bodyschema
