#include "bodyschema/evaluation/evaluate.hpp"

#include <spdlog/fmt/fmt.h>
#include <spdlog/fmt/ranges.h>

#include <algorithm>
#include <limits>

#include "bodyschema/core/error.hpp"
#include "bodyschema/core/nearest_name.hpp"
#include "bodyschema/core/write_file.hpp"
#include "bodyschema/pipeline/pipeline.hpp"
#include "bodyschema/simulator/simulator_settings.hpp"
#include "experiments.hpp"

namespace bodyschema {
namespace {

std::string at_most(int trials) {
  return fmt::format("; at most {} trials", trials);
}

struct Experiment {
  std::string name, meaning;
  ExperimentRun run;
  bool alone = false;  ///< no part of `all`
};

void run_honesty_and_recording(ExperimentContext& context) {
  const bool whole = context.options.experiment == "honesty";
  run_honesty(context, whole ? std::numeric_limits<int>::max() : kHonestyLogsInAll);
  if (whole && context.options.rows.empty()) run_recording(context, true);
}

/// In the order in which they are run.
const std::vector<Experiment>& experiments() {
  static const std::vector<Experiment> list = {
      {"paper", "experiment 1 with the published filter, stereo and mono (Table I)",
       [](ExperimentContext& c) { run_experiment1(c, true); }, true},
      {"experiment1", "offsets in the arm, both modes, stereo and mono (Table I, Fig. 6)",
       [](ExperimentContext& c) { run_experiment1(c, false); }},
      {"clutter", "experiment 1 before a cluttered background", run_clutter},
      {"mismatch", "camera, mesh size and fingers differ a little from the model", run_mismatch},
      {"experiment2", "offsets in arm and head (Fig. 8)", run_experiment2},
      {"offsets",
       fmt::format("the offsets themselves and their intervals after 60 s of babbling; always {} trials", kOffsetLogs),
       run_offsets},
      {"slip", "a joint slips by 5 degrees in mid-run" + at_most(kMostAdaptationTrials), run_slip},
      {"leave", "the hand leaves the view and comes back" + at_most(kMostAdaptationTrials), run_hand_leaves},
      {"camera", "one camera dies" + at_most(kMostAdaptationTrials), run_camera_dies},
      {"likelihood", "likelihood over one offset, two arm postures (Fig. 2); always one trial", run_likelihood},
      {"ablation", "best with one part taken away at a time" + at_most(kMostAblationTrials), run_ablations},
      {"reach", "hand to target with the nominal and with the corrected model", run_reach},
      {"recording",
       "the public recording, exact and nominal robot; always one log, paper with ten seeds (needs BODYSCHEMA_DATA)",
       [](ExperimentContext& c) { run_recording(c, false); }},
      {"honesty",
       fmt::format("whether what is published can be believed although the robot is not as described; two logs a "
                   "trial (--rows), within all at most {}",
                   kHonestyLogsInAll),
       run_honesty_and_recording},
      {"real", "photographs of physical robots with offsets hidden in them, where the data is there; up to 10 trials",
       run_real},
      {"everyday",
       fmt::format("everyday pictures, a row a condition (--rows); within `all` at most {} trials a row",
                   kMostEverydayTrials),
       run_everyday},
      {"diagnosis", "rates of the diagnosis on logs with hidden faults; --trials sets the single-cause logs",
       run_diagnosis, true},
      {"live",
       fmt::format("rates of the running service's diagnosis, half of the robots healthy; --trials runs of "
                   "60 s in real time, in all at most {}",
                   kMostLiveRuns),
       run_live}};
  return list;
}

}  // namespace

const std::vector<std::pair<std::string, std::string>>& experiment_names() {
  static const auto names = [] {
    std::vector<std::pair<std::string, std::string>> list;
    for (const auto& experiment : experiments()) list.emplace_back(experiment.name, experiment.meaning);
    list.emplace_back("all", "everything but paper and diagnosis");
    return list;
  }();
  return names;
}

bool is_asked_for(const EvaluationOptions& options, const std::string& row) {
  return options.rows.empty() || std::find(options.rows.begin(), options.rows.end(), row) != options.rows.end();
}

void check_rows(const EvaluationOptions& options, const std::vector<std::string>& names) {
  for (const auto& row : options.rows) {
    if (std::find(names.begin(), names.end(), row) != names.end()) continue;
    throw ConfigurationError("--rows: " + options.experiment + " has no row '" + row + "'; did you mean '" +
                             nearest_name(row, names) + "'?");
  }
}

void run_in_turn(std::span<const ExperimentRun> experiments, ExperimentContext& context,
                 const std::filesystem::path& file) {
  for (const auto run : experiments) {
    run(context);
    write_file(file, context.summary.dump(2) + '\n');
  }
}

std::string evaluate(const Configuration& simulated, const std::filesystem::path& recorded,
                     const EvaluationOptions& options) {
  std::vector<std::string> names;
  for (const auto& [name, meaning] : experiment_names()) names.push_back(name);
  if (std::find(names.begin(), names.end(), options.experiment) == names.end()) {
    throw ConfigurationError("experiment '" + options.experiment + "' is not known; did you mean '" +
                             nearest_name(options.experiment, names) + "'?");
  }
  const auto has_rows = {"everyday", "honesty", "real"};
  if (!options.rows.empty() && std::find(has_rows.begin(), has_rows.end(), options.experiment) == has_rows.end()) {
    throw ConfigurationError(
        fmt::format("--rows: '{}' has no rows; expected with {}", options.experiment, fmt::join(has_rows, ", ")));
  }
  // Whoever reads a section knows its keys; a mistyped one is an error before the work, not after.
  const Pipeline reader(simulated);
  simulator::SimulatorSettings::from(simulated.section("simulator"));
  simulated.reject_unknown_keys();
  if (reader.options().mode != EstimatorMode::kBest) {
    throw ConfigurationError(
        "estimator.mode: 'paper' changes nothing here: every experiment runs the modes it compares");
  }

  make_folder(options.out);
  const auto file = options.out / "summary.json";
  write_file(file, "");  // or why not, before the work and not after

  std::vector<ExperimentRun> wanted;
  for (const auto& experiment : experiments()) {
    const bool part_of_all = options.experiment == "all" && !experiment.alone;
    if (experiment.name == options.experiment || part_of_all) wanted.push_back(experiment.run);
  }
  // An hour's work does not end at what it needs last.
  if (std::find(wanted.begin(), wanted.end(), &run_live) != wanted.end()) check_live_programs(programs_folder());

  Json summary = {{"trials_asked_for", options.trials}, {"seed", options.seed}};
  std::string table;
  Report report("Body Schema: experiment " + options.experiment);
  ExperimentContext context{simulated, recorded, options, summary, table, report};
  run_in_turn(wanted, context, file);
  report.figures_first(
      table, options.experiment == "diagnosis"
                 ? fmt::format("Trials: {}, seed {}.", options.trials, options.seed)
                 : fmt::format("Seeds from {} on, as many trials as the tables say. A simulated robot in all of them.",
                               options.seed));
  report.write(options.out / "report.html");
  return table;
}

}  // namespace bodyschema
