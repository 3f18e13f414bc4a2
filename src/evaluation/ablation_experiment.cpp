#include "experiments.hpp"
#include "reach_figures.hpp"
#include "trial_runner.hpp"

namespace bodyschema {
namespace {

struct Ablation {
  std::string name;  ///< key in the summary
  std::string what;
  EstimatorOptions options;
  bool offsets_only = false;
};

/// `best` with one of its parts taken away at a time, from nothing missing to only a sharper
/// likelihood left.
std::vector<Ablation> ablations(const ExperimentContext& context) {
  const EstimatorOptions best = options_for(context, "best");
  std::vector<Ablation> rows = {{"none", "best", best}};
  const auto without = [&](const char* name, const char* what) -> EstimatorOptions& {
    rows.push_back({name, what, best});
    return rows.back().options;
  };
  without("fusion", "each frame for itself").remember = false;
  {
    auto& memory = without("posture_error", "postures taken as free of error").memory;
    memory.encoder_sd_rad = memory.posture_sd_rad = 1e-9;
    memory.posture_prior = 1e9;
  }
  without("nuisances", "joint offsets only");
  rows.back().offsets_only = true;
  without("particles", "10 particles").filter.particles = 10;
  without("refinement", "no outline refinement: particles only").refine_outline = false;
  rows.push_back({"paper", "the published filter", options_for(context, "paper")});
  return rows;
}

}  // namespace

void run_ablations(ExperimentContext& context) {
  const std::vector<Ablation> rows = ablations(context);
  std::vector<Contestant> contestants;
  for (const auto& row : rows) contestants.push_back({row.what, row.options, false, row.offsets_only});
  const int trials = std::min(context.options.trials, kMostAblationTrials);

  struct Condition {
    const char* key;
    const char* title;
    std::function<TrialSetting(std::uint64_t)> setting;
  };
  const Condition conditions[] = {{"experiment1", "what each part is worth: experiment 1",
                                   [&](std::uint64_t) { return standard_setting(context); }},
                                  {"mismatch", "what each part is worth: model mismatch",
                                   [&](std::uint64_t seed) { return mismatch_setting(context, seed); }}};
  for (const auto& condition : conditions) {
    const auto records = run_trials(context, condition.title, trials, condition.setting, contestants);
    add_heading(context, condition.title, trials);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const ReachResult result = reach_result(records, i, kLeft);
      context.summary["ablation"][rows[i].name][condition.key] = to_json(result);
      add_row(context, rows[i].what, result);
    }
    chart_errors(context, condition.title, records, contestants, kLeft);
  }
}

}  // namespace bodyschema
