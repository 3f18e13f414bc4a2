#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "bodyschema/diagnosis/diagnosis_report.hpp"
#include "bodyschema/effects/across_axis.hpp"

namespace bodyschema {

/// What one log says of a cause that another one was found to have.
enum class Judgement {
  kAgrees,       ///< it has it too, and of a size that agrees
  kDiffers,      ///< it has it too, and of another size
  kContradicts,  ///< it excludes that size and has room for none
  kNothing,      ///< it cannot tell: not testable, or not nearly enough
};
/// "agrees", "differs", "contradicts", "says nothing".
const char* name_of(Judgement judgement);

struct JudgedClaim {
  std::size_t claimed_by = 0, judged_by = 0;  ///< positions of the logs
  CauseName cause;
  std::string claim;  ///< the sentence of the log that found it
  Judgement judgement = Judgement::kNothing;
  std::string why;  ///< "0.1 mm (-0.2 to 0.4) there"
};

/// A cause that all logs that can tell have, with its size from all of them together.
struct CommonCause {
  DiagnosedCause cause;
  std::vector<std::size_t> logs;  ///< that agree, by position
};

/// An offset that changed from one log to the next by more than both claim: the joint slipped between them.
struct OffsetChange {
  std::size_t before = 0, after = 0;  ///< positions of the logs
  std::string joint;
  double change_deg = 0.0;  ///< of encoder minus true angle
  std::array<double, 2> ci95_deg{};
};

/// Logs of one robot, side by side: what is common is the robot's, what differs happened between them.
struct LogComparison {
  std::vector<std::string> logs;  ///< names
  std::string sentence;
  std::vector<CommonCause> common;
  std::vector<JudgedClaim> claims;
  std::vector<OffsetChange> changes;
  std::vector<std::string> not_compared;  ///< joints whose offsets mean other things in the logs

  /// The keys of comparison.json.
  [[nodiscard]] std::string to_json() const;
  /// Writes comparison.json and comparison.html. Throws as write_file (core/write_file.hpp).
  void write(const std::filesystem::path& directory) const;
};

/// Compares the diagnoses of two logs or more, in the order in which they were recorded.
/// @param logs  their names, as many as reports
/// @param across  directions of the joints' axes, for sentences; empty: left out
LogComparison compare(const std::vector<DiagnosisReport>& reports, std::vector<std::string> logs,
                      const JointRoles& roles, const std::vector<AcrossAxis>& across = {});

}  // namespace bodyschema
