#include "bodyschema/bus/joint_assembler.hpp"

namespace bodyschema {

JointAssembler::JointAssembler(const std::vector<std::string>& joint_names,
                               const std::map<std::string, double>& resting_rad) {
  now_.utime = -1;
  now_.q.setZero(static_cast<Eigen::Index>(joint_names.size()));
  now_.qdot.setZero(now_.q.size());
  for (std::size_t j = 0; j < joint_names.size(); ++j) {
    index_.emplace(joint_names[j], static_cast<Eigen::Index>(j));
  }
  for (const auto& [name, value] : resting_rad) {
    if (const auto at = index_.find(name); at != index_.end()) now_.q[at->second] = value;
  }
}

const JointSample* JointAssembler::take(const JointStateMessage& message) {
  if (message.utime < now_.utime) return nullptr;
  bool known = false;
  for (std::size_t i = 0; i < message.names.size() && i < message.position_rad.size(); ++i) {
    const auto at = index_.find(message.names[i]);
    if (at == index_.end()) continue;
    now_.q[at->second] = static_cast<double>(message.position_rad[i]);
    known = true;
  }
  if (!known) return nullptr;
  now_.utime = message.utime;
  return &now_;
}

}  // namespace bodyschema
