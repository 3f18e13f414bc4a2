#include <spdlog/fmt/fmt.h>

#include "experiments.hpp"
#include "reach_figures.hpp"
#include "trial_runner.hpp"

namespace bodyschema {
namespace {

using simulator::FaultSpec;

/// Both modes on the same pictures; results under summary[mode][key].stereo.
void compare_modes(ExperimentContext& context, const std::string& title, const std::string& key, int trials,
                   const std::function<TrialSetting(std::uint64_t)>& setting_of, std::size_t camera) {
  const std::vector<Contestant> contestants = stereo_contestants(context);
  const auto records = run_trials(context, title, trials, setting_of, contestants);
  add_heading(context, title, trials);
  chart_errors(context, title, records, contestants, camera);
  for (std::size_t i = 0; i < contestants.size(); ++i) {
    const ReachResult result = reach_result(records, i, camera);
    context.summary[modes()[i]][key]["stereo"] = to_json(result);
    add_row(context, contestants[i].name, result);
    if (camera == kRight) {
      const ReachResult left = reach_result(records, i, kLeft);
      context.summary[modes()[i]][key]["stereo_left_eye"] = to_json(left);
      add_row(context, contestants[i].name + ", left eye", left);
    }
  }
}

}  // namespace

void run_experiment1(ExperimentContext& context, bool paper_only) {
  std::vector<Contestant> contestants;
  for (const auto& mode : modes()) {
    if (paper_only && mode != "paper") continue;
    contestants.push_back({mode + ".stereo", options_for(context, mode), false});
    contestants.push_back({mode + ".mono", options_for(context, mode), true});
  }
  const auto records = run_trials(
      context, "experiment 1: offsets in the arm", context.options.trials,
      [&](std::uint64_t) { return standard_setting(context); }, contestants);
  add_heading(context, "experiment 1: offsets in the arm", context.options.trials);
  chart_errors(context, "experiment 1: offsets in the arm", records, contestants, kLeft);
  for (std::size_t i = 0; i < contestants.size(); ++i) {
    const ReachResult result = reach_result(records, i, kLeft);
    const std::string mode = contestants[i].name.substr(0, contestants[i].name.find('.'));
    context.summary[mode]["experiment1"][contestants[i].mono ? "mono" : "stereo"] = to_json(result);
    add_row(context, contestants[i].name, result);
  }
  std::vector<double> nominal;
  for (const auto& record : records) {
    nominal.push_back(mean_of_last(record.contestants[0].frames, kLeft, &FrameRecord::nominal_mm));
  }
  context.table += fmt::format("{:<38} {:>5.2f}\n", "without correction", Statistics::of(nominal).mean);
  context.table += fmt::format("{:<38} {:>5.2f} +- {:<5.2f} {:>5.2f} +- {:<5.2f}\n", "Table I of the paper (stereo)",
                               3.34, 1.52, 4.55, 2.03);
  for (std::size_t i = 0; i < contestants.size(); ++i) {
    if (contestants[i].mono) continue;
    judge_converged(context, paper_only ? "paper" : modes()[i / 2], records, i);
  }
}

void run_clutter(ExperimentContext& context) {
  compare_modes(
      context, "experiment 1 before clutter", "experiment1_clutter", context.options.trials,
      [&](std::uint64_t) {
        TrialSetting setting = standard_setting(context);
        setting.simulator.clutter = true;
        return setting;
      },
      kLeft);
}

void run_mismatch(ExperimentContext& context) {
  compare_modes(
      context, "model mismatch", "mismatch", context.options.trials,
      [&](std::uint64_t seed) { return mismatch_setting(context, seed); }, kLeft);
}

void run_experiment2(ExperimentContext& context) {
  compare_modes(
      context, "experiment 2: offsets in arm and head", "experiment2", context.options.trials,
      [&](std::uint64_t) {
        TrialSetting setting = standard_setting(context);
        setting.plan.faults = {
            FaultSpec::of("head_offset", "neck_pitch", -4), FaultSpec::of("head_offset", "neck_roll", 6),
            FaultSpec::of("head_offset", "neck_yaw", -2), FaultSpec::of("head_offset", "eyes_tilt", -1)};
        return setting;
      },
      kRight);
}

}  // namespace bodyschema
