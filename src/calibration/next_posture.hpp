#pragma once

#include <map>
#include <optional>
#include <string>

#include "bodyschema/evidence/batch_fit.hpp"
#include "bodyschema/robot/robot_setup.hpp"

namespace bodyschema {

/// A posture that is worth recording.
struct NextPosture {
  std::map<std::string, double> joints_rad;  ///< the arm's, as its encoders are to read
  std::string tells;                         ///< the joint whose interval it shrinks most
};

/// Of many random postures within the joints' limits and in view of the cameras, the one after which the joint that is
/// told worst, of those that postures can tell better, would be told best. Nothing where none helps by a tenth.
std::optional<NextPosture> next_posture(LogFit& fit, const BatchFit& batch, const RobotSetup& setup);

}  // namespace bodyschema
