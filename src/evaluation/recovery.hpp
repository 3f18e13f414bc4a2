#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "bodyschema/evaluation/statistics.hpp"
#include "experiments.hpp"

namespace bodyschema {

/// From an event on: how long until the hand is known again, and whether the uncertainty said so.
struct Recovery {
  std::optional<double> frames;     ///< until below 1 mm for good; nothing: not within the run
  double frames_outside_999 = 0.0;  ///< with the truth outside the estimate's own 99.9 % region
};

/// @param event  index of the first frame that counts
/// @param camera  in whose frame the hand is judged
Recovery recovery(const std::vector<FrameRecord>& frames, std::size_t event, std::size_t camera);

/// The trials of one contestant.
struct RecoveryFigures {
  std::size_t trials = 0;
  std::size_t never = 0;         ///< trials that did not recover
  Statistics frames_to_recover;  ///< of those that did
  Statistics frames_outside_999;
  std::size_t slowest = 0;  ///< trial that took longest, for those who want to look at it
};
RecoveryFigures figures_of(const std::vector<Recovery>& recoveries);

Json to_json(const RecoveryFigures& figures);
/// For people, without the line's end.
/// @param first_seed  of the first trial
std::string describe(const RecoveryFigures& figures, std::uint64_t first_seed);

}  // namespace bodyschema
