#pragma once

#include <map>
#include <string>
#include <vector>

#include "bodyschema/bus/bus_options.hpp"
#include "bodyschema/bus/joint_assembler.hpp"
#include "bodyschema/bus/messages.hpp"
#include "bodyschema/observation/observation.hpp"
#include "bodyschema/robot/robot_model.hpp"
#include "bodyschema/robot/robot_setup.hpp"

namespace bodyschema {

/// Joint messages of a log as samples of all joints, in order of time. Where head and arm come apart, a joint
/// of one stands between its readings when the other comes: repeating its last value would make stairs of quick
/// motion.
class JointStream {
 public:
  JointStream(const RobotModel& robot, const RobotSetup& setup, const BusOptions& bus);
  /// A message that does not decode or names none of the robot's joints is left out, and one that is older than
  /// the last of its own joints. Where the stamps begin anew (JointAssembler), what has a later one is taken back:
  /// a single stamp far in the future costs no more than itself.
  void take(Bytes message);
  /// The samples; velocities as published, which set_motion replaces.
  std::vector<JointSample> finish();

 private:
  void mark_read();

  DecodeLimits limits_;
  JointStateMessage joints_;
  JointAssembler assembler_;
  std::map<std::string, std::size_t> index_;
  std::vector<JointSample> stream_;
  std::vector<std::vector<bool>> read_;  ///< which joints a sample's own messages carried
};

}  // namespace bodyschema
