#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "bodyschema/diagnosis/diagnoser.hpp"
#include "bodyschema/effects/effect_kind.hpp"
#include "bodyschema/effects/joint_roles.hpp"
#include "bodyschema/observation/observation.hpp"

namespace bodyschema::diagnosis {

/// How much of an arm's motion pictures show.
struct LogLength {
  double seconds = 0.0;      ///< of pictures, without times in which a still arm was moved to another still posture
  std::size_t postures = 0;  ///< in which it was held still, no two of them the same; counted as far as are needed
  double moved_rad = 0.0;    ///< a joint's furthest from where it was in the first picture
};

/// @param pictures  joints at the exposures in order of time; those without velocities count as still.
///   An arm that needs more than a second to leave a posture (options.same_posture_rad) is still
LogLength log_length(std::span<const JointSample> pictures, const JointRoles& roles, const DiagnosisOptions& options);

/// The one sentence for a log that no diagnosis can use: what it has, what is needed, and which causes its motion would
/// leave untested besides, on whatever joint. Empty: it is long enough.
/// @param not_testable  for the motion of the log
std::string why_too_short(const LogLength& length, const std::vector<NotTestable>& not_testable,
                          const JointRoles& roles, const DiagnosisOptions& options);

}  // namespace bodyschema::diagnosis
