#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "bodyschema/core/configuration.hpp"

namespace bodyschema {

struct EvaluationOptions {
  /// "paper" (experiment 1 with the published filter), one experiment by name, or "all".
  std::string experiment = "all";
  std::filesystem::path out;  ///< folder for summary.json and report.html, created
  int trials = 30;            ///< where experiment_names() says no other number
  std::uint64_t seed = 7;
  int threads = 0;  ///< trials run side by side; 0: one per core
  /// The recording eyehand-sim and the official models; experiments that need them are skipped
  /// where the folder is absent.
  std::filesystem::path data;
  /// diagnosis: logs of masks, with noise along their outlines, of 40 s at 5 Hz, instead of pictures of 60 s at 10 Hz:
  /// five times as fast.
  bool masks = false;
  /// diagnosis: no further log is begun after so many minutes, and what is done is summed up. 0: all of them.
  double minutes = 0.0;
  /// diagnosis: logs that trials.jsonl in `out` has of the same seed, robot and kind are not run again, as after a run
  /// that was stopped. It does not ask whether the program has changed since.
  bool resume = false;
  /// Choices of the command line ("filter.particles=500"), in force in `simulated` already. Those about
  /// estimating are applied to the recording's robots too; its robot, cameras and bus are its own.
  std::vector<std::string> overrides;
  std::vector<std::string> rows;  ///< of `everyday`, `honesty` and `real`: only these; empty: all
  double everyday_s = 30.0;       ///< length of each of its logs, s
};

/// Names accepted by EvaluationOptions::experiment, with one line about each.
const std::vector<std::pair<std::string, std::string>>& experiment_names();

/// Runs experiments on the simulator of our own robot and on the public recording, writes
/// `summary.json` and `report.html`, and returns the table for people. Trials are seeded seed, seed + 1, ...; the
/// result does not depend on the number of threads.
/// @param simulated  configuration that holds estimator and simulator of our own robot
/// @param recorded  folder that holds icub_unity/ and icub_v2_5/ configurations
/// Throws Error.
std::string evaluate(const Configuration& simulated, const std::filesystem::path& recorded,
                     const EvaluationOptions& options);

}  // namespace bodyschema
