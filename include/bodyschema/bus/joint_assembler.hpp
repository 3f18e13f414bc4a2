#pragma once

#include <map>
#include <string>
#include <vector>

#include "bodyschema/bus/messages.hpp"
#include "bodyschema/observation/observation.hpp"

namespace bodyschema {

/// Joint messages, each of which may carry some of the robot's joints only, as samples of all joints
/// at the messages' own times: what effects with memory live on. Joints of which nothing came rest.
/// Velocities are left at zero. One thread.
class JointAssembler {
 public:
  /// @param joint_names  RobotModel order
  /// @param resting_rad  values of joints before their first reading; others at zero
  JointAssembler(const std::vector<std::string>& joint_names, const std::map<std::string, double>& resting_rad);

  /// The joints as known with this message; null when it carries none of ours or is older than the
  /// last. Head and arm with one stamp give two samples with it, the second complete. Valid until the
  /// next call.
  const JointSample* take(const JointStateMessage& message);
  /// Stamps may begin anew (clock step).
  void forget() { now_.utime = -1; }

 private:
  std::map<std::string, Eigen::Index> index_;
  JointSample now_;
};

}  // namespace bodyschema
