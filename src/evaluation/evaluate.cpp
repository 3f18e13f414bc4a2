#include "bodyschema/evaluation/evaluate.hpp"

#include <spdlog/fmt/fmt.h>

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

}  // namespace

const std::vector<std::pair<std::string, std::string>>& experiment_names() {
  static const std::vector<std::pair<std::string, std::string>> names = {
      {"paper", "experiment 1 with the published filter, stereo and mono (Table I)"},
      {"experiment1", "offsets in the arm, both modes, stereo and mono (Table I, Fig. 6)"},
      {"clutter", "experiment 1 before a cluttered background"},
      {"mismatch", "camera, mesh size and fingers differ a little from the model"},
      {"experiment2", "offsets in arm and head (Fig. 8)"},
      {"offsets",
       fmt::format("the offsets themselves and their intervals after 60 s of babbling; always {} trials", kOffsetLogs)},
      {"slip", "a joint slips by 5 degrees in mid-run" + at_most(kMostAdaptationTrials)},
      {"leave", "the hand leaves the view and comes back" + at_most(kMostAdaptationTrials)},
      {"camera", "one camera dies" + at_most(kMostAdaptationTrials)},
      {"likelihood", "likelihood over one offset, two arm postures (Fig. 2); always one trial"},
      {"ablation", "best with one part taken away at a time" + at_most(kMostAblationTrials)},
      {"reach", "hand to target with the nominal and with the corrected model"},
      {"recording",
       "the public recording, exact and nominal robot; always one log, paper with ten seeds (needs BODYSCHEMA_DATA)"},
      {"honesty",
       fmt::format("whether what is published can be believed although the robot is not as described; two logs a "
                   "trial (--rows), within all at most {}",
                   kHonestyLogsInAll)},
      {"real", "photographs of physical robots with offsets hidden in them, where the data is there; up to 10 trials"},
      {"everyday", fmt::format("everyday pictures, a row a condition (--rows); within `all` at most {} trials a row",
                               kMostEverydayTrials)},
      {"diagnosis", "rates of the diagnosis on logs with hidden faults; --trials sets the single-cause logs"},
      {"live", fmt::format("rates of the running service's diagnosis, half of the robots healthy; --trials runs of "
                           "60 s in real time, in all at most {}",
                           kMostLiveRuns)},
      {"all", "everything but paper and diagnosis"}};
  return names;
}

std::string evaluate(const Configuration& simulated, const std::filesystem::path& recorded,
                     const EvaluationOptions& options) {
  std::vector<std::string> names;
  for (const auto& [name, meaning] : experiment_names()) names.push_back(name);
  if (std::find(names.begin(), names.end(), options.experiment) == names.end()) {
    throw ConfigurationError("experiment '" + options.experiment + "' is not known; did you mean '" +
                             nearest_name(options.experiment, names) + "'?");
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

  Json summary;
  std::string table;
  Report report("Body Schema: experiment " + options.experiment);
  ExperimentContext context{simulated, recorded, options, summary, table, report};
  const auto wanted = [&](const char* name) { return options.experiment == name || options.experiment == "all"; };
  if (options.experiment == "paper") run_experiment1(context, true);
  if (wanted("experiment1")) run_experiment1(context, false);
  if (wanted("clutter")) run_clutter(context);
  if (wanted("mismatch")) run_mismatch(context);
  if (wanted("experiment2")) run_experiment2(context);
  if (wanted("offsets")) run_offsets(context);
  if (wanted("slip")) run_slip(context);
  if (wanted("leave")) run_hand_leaves(context);
  if (wanted("camera")) run_camera_dies(context);
  if (wanted("likelihood")) run_likelihood(context);
  if (wanted("ablation")) run_ablations(context);
  if (wanted("reach")) run_reach(context);
  if (wanted("recording")) run_recording(context, false);
  if (wanted("real")) run_real(context);
  if (wanted("live")) run_live(context);
  if (options.experiment == "honesty") {
    run_honesty(context, std::numeric_limits<int>::max());
    if (options.rows.empty()) run_recording(context, true);
  }
  if (options.experiment == "all") run_honesty(context, kHonestyLogsInAll);
  if (wanted("everyday")) run_everyday(context);
  if (options.experiment == "diagnosis") run_diagnosis(context);
  summary["trials_asked_for"] = options.trials;
  summary["seed"] = options.seed;
  write_file(file, summary.dump(2) + '\n');
  report.figures_first(
      table, options.experiment == "diagnosis"
                 ? fmt::format("Trials: {}, seed {}.", options.trials, options.seed)
                 : fmt::format("Seeds from {} on, as many trials as the tables say. A simulated robot in all of them.",
                               options.seed));
  report.write(options.out / "report.html");
  return table;
}

}  // namespace bodyschema
