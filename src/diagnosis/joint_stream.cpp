#include "joint_stream.hpp"

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

std::vector<JointSample> JointStream::finish() { return std::move(stream_); }

}  // namespace bodyschema::diagnosis
