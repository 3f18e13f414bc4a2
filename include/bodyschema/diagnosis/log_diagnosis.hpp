#pragma once

#include <filesystem>
#include <optional>

#include "bodyschema/core/configuration.hpp"
#include "bodyschema/diagnosis/diagnoser.hpp"
#include "bodyschema/diagnosis/log_comparison.hpp"

namespace bodyschema {

struct LogDiagnosisOptions {
  std::filesystem::path log;
  std::filesystem::path out;  ///< folder, created; empty: nothing is written
  /// The file that the configuration was read from, for the commands that say what to do next; empty: not known.
  std::filesystem::path configuration;
  double picture_rate_hz = 10.0;  ///< pictures used per second and camera
  int threads = 2;
  bool quiet = false;     ///< no progress bars
  bool fit_only = false;  ///< DiagnosisOptions::fit_only
};

/// Diagnoses a recorded log: encoders and pictures in, report.json, report.html and extended_model.yaml out.
/// The background is learned from the whole log, the estimator gives offsets to start from.
/// Throws Error; DataError says what to record where the log cannot be used.
DiagnosisReport diagnose_log(const Configuration& configuration, const LogDiagnosisOptions& options);

/// Diagnoses several logs of one robot, in the order in which they were recorded, each into a folder of its own in
/// `out`, and compares them: comparison.json and comparison.html. Throws as diagnose_log.
/// @param options  `log` is not looked at
LogComparison diagnose_logs(const Configuration& configuration, const LogDiagnosisOptions& options,
                            const std::vector<std::filesystem::path>& logs);

}  // namespace bodyschema
