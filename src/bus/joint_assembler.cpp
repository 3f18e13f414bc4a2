#include "bodyschema/bus/joint_assembler.hpp"

#include <algorithm>

#include "clock_step.hpp"

namespace bodyschema {

JointAssembler::JointAssembler(const std::vector<std::string>& joint_names,
                               const std::map<std::string, double>& resting_rad, Microseconds clock_step,
                               const std::set<std::string>& idle)
    : read_(joint_names.size(), -1), clock_step_(clock_step) {
  now_.utime = -1;
  now_.q.setZero(static_cast<Eigen::Index>(joint_names.size()));
  now_.qdot.setZero(now_.q.size());
  for (std::size_t j = 0; j < joint_names.size(); ++j) {
    const auto at = static_cast<Eigen::Index>(j);
    if (const auto resting = resting_rad.find(joint_names[j]); resting != resting_rad.end())
      now_.q[at] = resting->second;
    if (!idle.contains(joint_names[j])) index_.emplace(joint_names[j], at);
  }
}

const JointSample* JointAssembler::take(const JointStateMessage& message) {
  const auto for_each_of_ours = [&](auto action) {
    for (std::size_t i = 0; i < message.names.size() && i < message.position_rad.size(); ++i) {
      if (const auto at = index_.find(message.names[i]); at != index_.end()) action(at->second, i);
    }
  };
  bool known = false;
  Microseconds last = -1;
  for_each_of_ours([&](Eigen::Index joint, std::size_t) {
    known = true;
    last = std::max(last, read_[static_cast<std::size_t>(joint)]);
  });
  if (!known) return nullptr;
  if (now_.utime - message.utime > clock_step_) {
    if (++far_before_in_a_row_ < kStepEvidence) return nullptr;
    forget();
    last = -1;
  }
  far_before_in_a_row_ = 0;
  if (message.utime < last) return nullptr;
  for_each_of_ours([&](Eigen::Index joint, std::size_t i) {
    now_.q[joint] = static_cast<double>(message.position_rad[i]);
    read_[static_cast<std::size_t>(joint)] = message.utime;
  });
  now_.utime = std::max(now_.utime, message.utime);
  return &now_;
}

void JointAssembler::forget() {
  std::fill(read_.begin(), read_.end(), -1);
  far_before_in_a_row_ = 0;
  now_.utime = -1;
}

}  // namespace bodyschema
