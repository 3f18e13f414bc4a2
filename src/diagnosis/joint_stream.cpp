#include "joint_stream.hpp"

#include <algorithm>

namespace bodyschema::diagnosis {

JointStream::JointStream(const RobotModel& robot, const RobotSetup& setup, const BusOptions& bus)
    : limits_(bus.limits) {
  for (const auto& joint : robot.joints()) {
    const auto i = static_cast<Eigen::Index>(index_.size());
    index_[joint.name] = i;
  }
  now_.q = setup.default_joints(robot);
  now_.qdot.setZero(robot.joint_count());
}

void JointStream::take(Bytes message) {
  if (!decode(message, joints_, limits_).ok()) return;
  bool known = false;
  for (std::size_t i = 0; i < joints_.names.size() && i < joints_.position_rad.size(); ++i) {
    const auto at = index_.find(joints_.names[i]);
    if (at == index_.end()) continue;
    now_.q[at->second] = static_cast<double>(joints_.position_rad[i]);
    known = true;
  }
  if (!known || (!stream_.empty() && joints_.utime <= stream_.back().utime)) return;
  now_.utime = joints_.utime;
  stream_.push_back(now_);
}

std::vector<JointSample> JointStream::finish() {
  constexpr Microseconds kHalfWindow = 30'000;
  std::size_t a = 0, b = 0;
  for (std::size_t i = 0; i < stream_.size(); ++i) {
    while (a < i && stream_[a].utime < stream_[i].utime - kHalfWindow)
      ++a;
    b = std::max(b, i);
    while (b + 1 < stream_.size() && stream_[b + 1].utime <= stream_[i].utime + kHalfWindow)
      ++b;
    const std::size_t low = a == i && i > 0 ? i - 1 : a;
    const std::size_t high = b == i && i + 1 < stream_.size() ? i + 1 : b;
    if (high > low) {
      stream_[i].qdot =
          (stream_[high].q - stream_[low].q) / seconds(stream_[high].utime - stream_[low].utime);
    }
  }
  return std::move(stream_);
}

}  // namespace bodyschema::diagnosis
