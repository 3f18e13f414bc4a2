#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "bodyschema/core/configuration.hpp"
#include "bodyschema/pipeline/pipeline.hpp"

namespace bodyschema {

struct ReplayOptions {
  std::filesystem::path log;
  std::filesystem::path out;                   ///< folder, created
  std::optional<std::filesystem::path> truth;  ///< adds errors; never seen by the estimator
  int overlays = 3;                            ///< overlay pictures spread over the log
  bool masks = false;                          ///< write the masks beside them
  /// Learn the background (`vision.method: learned_background`) from the first pictures, as the daemon
  /// does, which cannot look ahead: with the arm in them it would be learned as background. Otherwise it
  /// is learned from all pictures of the log before the first estimate.
  bool learn_background_online = false;
  /// `vision.method: auto`: the robot's colours, read at the start where the file is there, and written at the end;
  /// absent: every replay learns them anew, and what was learned before changes no result.
  std::optional<std::filesystem::path> looks;
  /// Who watches beside the estimator, as LiveDiagnosis does beside the service's: made for the pipeline, called after
  /// each step, may add to the estimate.
  using Watcher = std::function<void(const Observation& observation, Estimate& estimate)>;
  std::function<Watcher(const Pipeline& pipeline)> watcher{};
};

/// Runs a recorded log through the same code as the daemon, as fast as it can, and writes
/// `estimates.jsonl` (one object per frame), `summary.json` and overlay pictures into `out`.
/// Returns a table for people. Throws Error.
std::string replay(const Configuration& configuration, const ReplayOptions& options);

}  // namespace bodyschema
