#include "joint_stream.hpp"

#include <algorithm>

namespace bodyschema::diagnosis {

namespace {

std::vector<std::string> names_of(const RobotModel& robot) {
  std::vector<std::string> names;
  for (const auto& joint : robot.joints()) names.push_back(joint.name);
  return names;
}

std::map<std::string, double> resting_joints(const RobotModel& robot, const RobotSetup& setup) {
  std::map<std::string, double> values;
  const Eigen::VectorXd q = setup.default_joints(robot);
  for (Eigen::Index j = 0; j < q.size(); ++j) values[robot.joints()[static_cast<std::size_t>(j)].name] = q[j];
  return values;
}

}  // namespace

JointStream::JointStream(const RobotModel& robot, const RobotSetup& setup, const BusOptions& bus)
    : limits_(bus.limits), assembler_(names_of(robot), resting_joints(robot, setup)) {}

void JointStream::take(Bytes message) {
  if (!decode(message, joints_, limits_).ok()) return;
  const JointSample* sample = assembler_.take(joints_);
  if (sample == nullptr) return;
  if (!stream_.empty() && stream_.back().utime == sample->utime) {
    stream_.back() = *sample;  // head and arm apart, with one stamp
  } else {
    stream_.push_back(*sample);
  }
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
