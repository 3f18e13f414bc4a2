#pragma once

#include <string>
#include <vector>

#include "bodyschema/evaluation/statistics.hpp"
#include "experiments.hpp"

namespace bodyschema {

inline constexpr std::size_t kLeft = 0;
inline constexpr std::size_t kRight = 1;

/// What the trials of one contestant come to, in one camera.
struct ReachResult {
  std::size_t trials = 0;
  Statistics position_mm;         ///< of each trial's mean over its last ten frames
  Statistics rotation_deg;        ///< the same
  std::size_t never = 0;          ///< trials that did not end below 1 mm and 1 degree
  Statistics frames_to_converge;  ///< until below both for good, of the others
};

/// One of a frame's figures in a camera, averaged over the last ten frames that have it.
double mean_of_last(const std::vector<FrameRecord>& frames, std::size_t camera,
                    const std::array<double, 2> FrameRecord::*figure);

ReachResult reach_result(const std::vector<TrialRecord>& trials, std::size_t contestant, std::size_t camera);
Json to_json(const ReachResult& result);

/// Lines of the printed table.
void add_heading(ExperimentContext& context, const std::string& title, int trials);
void add_row(ExperimentContext& context, const std::string& name, const ReachResult& result);

/// Errors of the hand over the frames, mean over trials (Figs. 6 and 8).
void chart_errors(ExperimentContext& context, const std::string& title, const std::vector<TrialRecord>& trials,
                  const std::vector<Contestant>& contestants, std::size_t camera);

/// How often the state `converged` came in time, and how often it was wrong.
void judge_converged(ExperimentContext& context, const std::string& mode, const std::vector<TrialRecord>& trials,
                     std::size_t contestant);

}  // namespace bodyschema
