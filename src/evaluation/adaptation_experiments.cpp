#include <spdlog/fmt/fmt.h>

#include <algorithm>

#include "bodyschema/core/error.hpp"
#include "bodyschema/simulator/motion_planner.hpp"
#include "experiments.hpp"
#include "reach_figures.hpp"
#include "recovery.hpp"
#include "trial_runner.hpp"

namespace bodyschema {
namespace {

using simulator::FaultSpec;

constexpr std::size_t kEventFrame = 45;

/// Runs both modes and judges each trial by `judge(trial, contestant)`.
void run_adaptation(ExperimentContext& context, const std::string& title, const std::string& key,
                    const std::function<TrialSetting(std::uint64_t)>& setting_of,
                    const std::function<Recovery(const TrialRecord&, std::size_t)>& judge) {
  const std::vector<Contestant> contestants = stereo_contestants(context);
  const int trials = std::min(context.options.trials, kMostAdaptationTrials);
  const auto records = run_trials(context, title, trials, setting_of, contestants);
  chart_errors(context, title, records, contestants, kLeft);
  context.table += fmt::format("\n{} ({} trials)\n", title, trials);
  for (std::size_t i = 0; i < contestants.size(); ++i) {
    std::vector<Recovery> recoveries;
    for (const auto& record : records) recoveries.push_back(judge(record, i));
    const RecoveryFigures figures = figures_of(recoveries);
    context.summary[modes()[i]][key] = to_json(figures);
    context.table += fmt::format("{:<38} {}\n", contestants[i].name, describe(figures, context.options.seed));
  }
}

}  // namespace

void run_slip(ExperimentContext& context) {
  const std::vector<std::string> joints = RobotSetup::from(context.simulated.section("robot")).estimated_joints;
  run_adaptation(
      context, "a joint slips by 5 degrees", "slip",
      [&](std::uint64_t seed) {
        TrialSetting setting = standard_setting(context);
        FaultSpec slip = FaultSpec::of("slip", joints[seed % joints.size()], seed % 2 == 0 ? 5.0 : -5.0);
        slip.set("at", kEventFrame / setting.simulator.camera_rate_hz);
        setting.plan.faults = {slip};
        return setting;
      },
      [](const TrialRecord& record, std::size_t contestant) {
        return recovery(record.contestants[contestant].frames, kEventFrame, kLeft);
      });
}

void run_hand_leaves(ExperimentContext& context) {
  // A reach, out of view, two seconds outside, and back to where the reach ended.
  const RobotSetup setup = RobotSetup::from(context.simulated.section("robot"));
  const StereoRig rig = StereoRig::from(context.simulated.section("cameras"));
  const auto robot = load_robot(setup, rig);
  const auto setting_of = [&](std::uint64_t seed) {
    TrialSetting setting = standard_setting(context);
    simulator::MotionPlanner planner(robot, setup, rig, setting.simulator.motion, seed);
    simulator::Trajectory motion = planner.reach(3.3);
    const Eigen::VectorXd seen = motion.last();
    motion.move_to(planner.rest_posture(seen), 1.0);
    motion.hold(2.0);
    motion.move_to(seen, 1.0);
    motion.hold(0.5);
    setting.plan.motion = simulator::Motion::kGiven;
    setting.plan.given = motion;
    return setting;
  };
  const auto judge = [](const TrialRecord& record, std::size_t contestant) {
    const auto& frames = record.contestants[contestant].frames;
    std::size_t back = frames.size();
    while (back > 0 && frames[back - 1].state != EstimatorState::kHandNotInView) --back;
    if (back == 0) throw DataError("the hand never left the view: the experiment shows nothing");
    return recovery(frames, back, kLeft);
  };
  run_adaptation(context, "the hand leaves the view and comes back", "hand_leaves", setting_of, judge);
}

void run_camera_dies(ExperimentContext& context) {
  const auto dead_camera = [](std::uint64_t seed) { return static_cast<std::size_t>(seed % 2); };
  run_adaptation(
      context, "one camera dies", "camera_dies",
      [&](std::uint64_t seed) {
        TrialSetting setting = standard_setting(context);
        setting.plan.camera_dies = {dead_camera(seed), kEventFrame / setting.simulator.camera_rate_hz};
        return setting;
      },
      [&](const TrialRecord& record, std::size_t contestant) {
        return recovery(record.contestants[contestant].frames, kEventFrame, 1 - dead_camera(record.seed));
      });
}

}  // namespace bodyschema
