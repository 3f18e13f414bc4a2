#include "bodyschema/pipeline/joint_stream.hpp"

namespace bodyschema {

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
    : limits_(bus.limits), assembler_(names_of(robot), resting_joints(robot, setup), bus.synchroniser.clock_step) {
  for (const auto& name : names_of(robot)) index_.emplace(name, index_.size());
}

void JointStream::take(Bytes message) {
  if (!decode(message, joints_, limits_).ok()) return;
  const JointSample* sample = assembler_.take(joints_);
  if (sample == nullptr) return;
  while (!stream_.empty() && stream_.back().utime > sample->utime) {
    stream_.pop_back();
    read_.pop_back();
  }
  if (!stream_.empty() && stream_.back().utime == sample->utime) {
    stream_.back() = *sample;  // head and arm apart, with one stamp or one that has been overtaken
  } else {
    stream_.push_back(*sample);
    read_.emplace_back(index_.size(), false);
  }
  mark_read();
}

void JointStream::mark_read() {
  for (const auto& name : joints_.names) {
    if (const auto at = index_.find(std::string(name)); at != index_.end()) read_.back()[at->second] = true;
  }
}

std::vector<JointSample> JointStream::finish() {
  constexpr Microseconds kFarApart = 100'000;  // a joint of which so long nothing comes has stopped coming
  for (std::size_t j = 0; j < index_.size(); ++j) {
    const auto joint = static_cast<Eigen::Index>(j);
    std::size_t last = 0;
    for (std::size_t i = 0; i < stream_.size(); ++i) {
      if (!read_[i][j]) continue;
      const JointSample &from = stream_[last], &to = stream_[i];
      const bool between_readings = read_[last][j] && to.utime - from.utime <= kFarApart;
      for (std::size_t k = last + 1; between_readings && k < i; ++k) {
        const double share = seconds(stream_[k].utime - from.utime) / seconds(to.utime - from.utime);
        stream_[k].q[joint] = from.q[joint] + share * (to.q[joint] - from.q[joint]);
      }
      last = i;
    }
  }
  return std::move(stream_);
}

}  // namespace bodyschema
