#pragma once

#include <filesystem>
#include <functional>

#include "bodyschema/bus/observation_stream.hpp"
#include "bodyschema/core/configuration.hpp"
#include "bodyschema/diagnosis/diagnoser.hpp"

namespace bodyschema {

struct LogDiagnosisOptions {
  std::filesystem::path log;
  std::filesystem::path out;      ///< folder, created; empty: nothing is written
  double picture_rate_hz = 10.0;  ///< pictures used per second and camera
  int threads = 2;
  bool quiet = false;          ///< no progress bars
  DiagnosisOptions diagnosis;  ///< `nuisances` empty: the usual ones
};

/// Diagnoses a recorded log: encoders and pictures in, report.json, report.html and
/// extended_model.yaml out.
/// The background is learned from the whole log, the estimator gives the offsets to start from.
/// Throws Error; DataError says what to record where the log cannot be used.
DiagnosisReport diagnose_log(const Configuration& configuration, const LogDiagnosisOptions& options);

}  // namespace bodyschema
