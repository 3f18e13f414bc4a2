#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "bodyschema/evaluation/evaluate.hpp"
#include "bodyschema/evaluation/trial.hpp"
#include "bodyschema/report/report.hpp"

namespace bodyschema {

using Json = nlohmann::ordered_json;

/// What every experiment needs to know.
struct ExperimentContext {
  const Configuration& simulated;
  std::filesystem::path recorded;
  EvaluationOptions options;
  Json& summary;       ///< results by mode: summary["best"]["experiment1"]...
  std::string& table;  ///< lines for people
  Report& report;
};

/// Conditions of the simulated experiments: the paper's offsets, the background learned first.
TrialSetting standard_setting(const ExperimentContext& context);

/// Runs `trials` seeded trials on all cores with a progress bar; the order of the results is that
/// of the seeds. `setting_of` may differ from trial to trial.
std::vector<TrialRecord> run_trials(const ExperimentContext& context, const std::string& label,
                                    int trials,
                                    const std::function<TrialSetting(std::uint64_t)>& setting_of,
                                    const std::vector<Contestant>& contestants);

void run_experiment1(ExperimentContext& context, bool paper_only);
void run_clutter(ExperimentContext& context);
void run_mismatch(ExperimentContext& context);
void run_experiment2(ExperimentContext& context);
void run_offsets(ExperimentContext& context);
void run_slip(ExperimentContext& context);
void run_reach(ExperimentContext& context);
void run_recording(ExperimentContext& context);

}  // namespace bodyschema
