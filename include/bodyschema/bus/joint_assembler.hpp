#pragma once

#include <map>
#include <set>
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
  /// @param clock_step   three messages in a row further before the newest sample are stamps that begin anew
  /// @param idle         joints of no interest: they rest whatever comes of them, so that the stamps of their
  ///                     sender, a leg's board with a clock of its own, hold up nobody
  JointAssembler(const std::vector<std::string>& joint_names, const std::map<std::string, double>& resting_rad,
                 Microseconds clock_step, const std::set<std::string>& idle = {});

  /// The joints as known with this message; null when it carries none of ours or is older than the last of
  /// its own joints. Stamps rise: one that others have overtaken, as where head and arm come apart, counts at
  /// their stamp, which thus comes again, more complete. Where stamps begin anew they go back: that of a single
  /// message far in the future, whose sender then falls silent, hides nothing for long. Valid until the next call.
  const JointSample* take(const JointStateMessage& message);
  /// Stamps may begin anew (clock step).
  void forget();

 private:
  std::map<std::string, Eigen::Index> index_;
  std::vector<Microseconds> read_;  ///< stamp of each joint's last reading; -1: none
  Microseconds clock_step_;
  int far_before_in_a_row_ = 0;
  JointSample now_;
};

}  // namespace bodyschema
