#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "bodyschema/evaluation/evaluate.hpp"
#include "bodyschema/evaluation/trial.hpp"
#include "bodyschema/report/report.hpp"

namespace bodyschema {

using Json = nlohmann::ordered_json;

/// What takes long is not run more often than this, whatever the options ask for.
inline constexpr int kMostAdaptationTrials = 14;  ///< slip, hand leaves, camera dies
inline constexpr int kMostAblationTrials = 10;
inline constexpr int kMostLiveRuns = 4;        ///< live, as a part of all: each takes a minute
inline constexpr int kMostEverydayTrials = 2;  ///< within `all`: the rows are many
inline constexpr int kOffsetLogs = 6;          ///< never more or fewer
/// Of logs that `honesty` runs: two a trial, within `all` no more than this.
inline constexpr int kHonestyLogsInAll = 14;

/// What every experiment needs to know.
struct ExperimentContext {
  const Configuration& simulated;
  std::filesystem::path recorded;
  EvaluationOptions options;
  Json& summary;       ///< results by mode: summary["best"]["experiment1"]...
  std::string& table;  ///< lines for people
  Report& report;
};

void run_experiment1(ExperimentContext& context, bool paper_only);
void run_clutter(ExperimentContext& context);
void run_mismatch(ExperimentContext& context);
void run_experiment2(ExperimentContext& context);
void run_offsets(ExperimentContext& context);
void run_slip(ExperimentContext& context);
void run_hand_leaves(ExperimentContext& context);
void run_camera_dies(ExperimentContext& context);
void run_likelihood(ExperimentContext& context);
void run_ablations(ExperimentContext& context);
void run_reach(ExperimentContext& context);
/// @param only_honesty  only whether what is said of the nominal robot and of the official hand can be believed
void run_recording(ExperimentContext& context, bool only_honesty);
void run_real(ExperimentContext& context);
/// A humanoid that looks at its own hands: a part of `real`.
void run_humanoid(ExperimentContext& context);
/// @param most_logs  however many trials are asked for
/// Throws ConfigurationError for a row that does not exist.
void run_honesty(ExperimentContext& context, int most_logs);
/// Throws ConfigurationError for a row that does not exist.
void run_everyday(ExperimentContext& context);
void run_diagnosis(ExperimentContext& context);
void run_live(ExperimentContext& context);
/// Whether a row of an experiment is asked for: by its name, or as no row is named.
bool is_asked_for(const EvaluationOptions& options, const std::string& row);
/// Throws ConfigurationError for a row that is asked for and is none of these.
void check_rows(const EvaluationOptions& options, const std::vector<std::string>& names);

using ExperimentRun = void (*)(ExperimentContext&);

/// After each the summary is written to `file`, whatever becomes of the next one.
void run_in_turn(std::span<const ExperimentRun> experiments, ExperimentContext& context,
                 const std::filesystem::path& file);

/// Where this program lies, and those that run_live starts.
std::filesystem::path programs_folder();
/// Throws FileError naming one that is not there.
void check_live_programs(const std::filesystem::path& folder);

}  // namespace bodyschema
