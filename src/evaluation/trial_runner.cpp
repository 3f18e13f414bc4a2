#include "trial_runner.hpp"

#include <numeric>
#include <random>

#include "bodyschema/core/progress_bar.hpp"
#include "in_parallel.hpp"

namespace bodyschema {
namespace {

using simulator::FaultSpec;

constexpr int kBackgroundFrames = 30;

}  // namespace

const std::vector<std::string>& modes() {
  static const std::vector<std::string> names = {"best", "paper"};
  return names;
}

EstimatorOptions options_for(const ExperimentContext& context, const std::string& mode) {
  EstimatorOptions options = EstimatorOptions::from(context.simulated);
  options.mode = mode == "paper" ? EstimatorMode::kPaper : EstimatorMode::kBest;
  return options;
}

std::vector<Contestant> stereo_contestants(const ExperimentContext& context) {
  std::vector<Contestant> contestants;
  for (const auto& mode : modes()) {
    contestants.push_back({mode + ".stereo", options_for(context, mode), false});
  }
  return contestants;
}

TrialSetting standard_setting(const ExperimentContext& context) {
  TrialSetting setting{
      context.simulated, simulator::SimulatorSettings::from(context.simulated.section("simulator")), {}, {}};
  setting.simulator.background_frames = kBackgroundFrames;
  setting.simulator.entry_frames = 0;
  setting.simulator.clutter = false;
  setting.plan.frames = 100;
  setting.plan.offsets_deg = {{"r_shoulder_pitch", 5}, {"r_shoulder_roll", 4}, {"r_shoulder_yaw", 3}, {"r_elbow", -2},
                              {"r_wrist_prosup", 3},   {"r_wrist_pitch", -7},  {"r_wrist_yaw", 3}};
  return setting;
}

TrialSetting mismatch_setting(const ExperimentContext& context, std::uint64_t seed) {
  TrialSetting setting = standard_setting(context);
  std::mt19937_64 random(seed * 7919u + 3u);
  const auto sign = [&] { return (random() & 1u) != 0 ? 1.0 : -1.0; };
  auto& faults = setting.plan.faults;
  faults.push_back(FaultSpec::of("focal_length", "", 0.3 * sign()));
  for (const char* source : {"left", "right"}) {
    for (const char* axis : {"x", "y"}) {
      FaultSpec shift{"principal_point", {{"source", source}, {"axis", axis}}};
      shift.set("value", 0.5 * sign());
      faults.push_back(shift);
    }
  }
  faults.push_back(FaultSpec::of("mesh_scale", "", 0.5 * sign()));
  faults.push_back(FaultSpec::of("finger_posture", "", 2.0 * sign()));
  return setting;
}

std::vector<TrialRecord> run_trials(const ExperimentContext& context, const std::string& label, int trials,
                                    const std::function<TrialSetting(std::uint64_t)>& setting_of,
                                    const std::vector<Contestant>& contestants) {
  std::vector<std::uint64_t> seeds(static_cast<std::size_t>(trials));
  std::iota(seeds.begin(), seeds.end(), context.options.seed);
  return run_trials(context, label, seeds, setting_of, contestants);
}

std::vector<TrialRecord> run_trials(const ExperimentContext& context, const std::string& label,
                                    const std::vector<std::uint64_t>& seeds,
                                    const std::function<TrialSetting(std::uint64_t)>& setting_of,
                                    const std::vector<Contestant>& contestants) {
  std::vector<TrialRecord> records(seeds.size());
  // Settings are made before the work is shared out: configuration is read by one thread at a time.
  std::vector<TrialSetting> settings;
  for (const auto seed : seeds) settings.push_back(setting_of(seed));
  constexpr std::uint64_t kStepsOfATrial = 1000;
  ProgressBar bar(label, seeds.size() * kStepsOfATrial);
  in_parallel(seeds.size(), context.options.threads, [&](std::size_t t) {
    std::uint64_t done = 0;
    const auto progress = [&](double share) {
      const auto now = static_cast<std::uint64_t>(share * static_cast<double>(kStepsOfATrial));
      bar.advance(now - done);
      done = now;
    };
    records[t] = run_trial(settings[t], contestants, seeds[t], progress);
    progress(1.0);
  });
  return records;
}

}  // namespace bodyschema
