#pragma once

#include <vector>

#include "bodyschema/bus/bus_options.hpp"
#include "bodyschema/bus/joint_assembler.hpp"
#include "bodyschema/bus/messages.hpp"
#include "bodyschema/observation/observation.hpp"
#include "bodyschema/robot/robot_model.hpp"
#include "bodyschema/robot/robot_setup.hpp"

namespace bodyschema::diagnosis {

/// Joint messages of a log as samples of all joints, in order of time.
class JointStream {
 public:
  JointStream(const RobotModel& robot, const RobotSetup& setup, const BusOptions& bus);
  /// A message that does not decode or names none of the robot's joints is left out.
  void take(Bytes message);
  /// The samples; velocities as published, which set_motion replaces.
  std::vector<JointSample> finish();

 private:
  DecodeLimits limits_;
  JointStateMessage joints_;
  JointAssembler assembler_;
  std::vector<JointSample> stream_;
};

}  // namespace bodyschema::diagnosis
