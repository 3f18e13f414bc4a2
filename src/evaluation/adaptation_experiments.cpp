#include <spdlog/fmt/fmt.h>

#include <algorithm>

#include "bodyschema/core/error.hpp"
#include "bodyschema/evaluation/statistics.hpp"
#include "bodyschema/simulator/motion_planner.hpp"
#include "experiments.hpp"
#include "reach_figures.hpp"
#include "trial_runner.hpp"

namespace bodyschema {
namespace {

using simulator::FaultSpec;

constexpr std::size_t kEventFrame = 45;
constexpr int kMostTrials = 14;

/// From an event on: how long until the hand is known again, and whether the uncertainty said so.
struct Recovery {
  double frames_to_recover = 0.0;   ///< until below 1 mm for good
  double frames_outside_999 = 0.0;  ///< with the truth outside the published 99.9 % region
};

Recovery recovery(const std::vector<FrameRecord>& frames, std::size_t event, std::size_t camera) {
  // 99.9 % of a 3-D normal lies within 4.03 sd along one axis; hand_sd adds the three axes.
  constexpr double kRegion = 4.03;
  Recovery result;
  for (std::size_t i = event; i < frames.size(); ++i) {
    const double error_mm = frames[i].position_mm[camera];
    if (error_mm < 0.0) continue;
    if (error_mm >= 1.0) result.frames_to_recover = static_cast<double>(i - event + 1);
    if (error_mm > kRegion * frames[i].hand_sd_mm) ++result.frames_outside_999;
  }
  return result;
}

struct RecoveryFigures {
  Statistics frames_to_recover;
  Statistics frames_outside_999;
  std::size_t slowest = 0;  ///< trial that took longest, for those who want to look at it
};

RecoveryFigures figures_of(const std::vector<Recovery>& recoveries) {
  std::vector<double> recover, outside;
  for (const auto& r : recoveries) {
    recover.push_back(r.frames_to_recover);
    outside.push_back(r.frames_outside_999);
  }
  const auto slowest = std::max_element(recover.begin(), recover.end()) - recover.begin();
  return {Statistics::of(recover), Statistics::of(outside), static_cast<std::size_t>(slowest)};
}

Json to_json(const RecoveryFigures& figures) {
  return {
      {"frames_to_recover", {{"mean", figures.frames_to_recover.mean}, {"max", figures.frames_to_recover.worst}}},
      {"frames_outside_999", {{"mean", figures.frames_outside_999.mean}, {"max", figures.frames_outside_999.worst}}}};
}

void add_row(ExperimentContext& context, const std::string& name, const RecoveryFigures& f) {
  context.table +=
      fmt::format("{:<38} below 1 mm within {:>3.0f} frames (mean {:.1f}, slowest seed {}), outside 99.9 %: {:.0f}\n",
                  name, f.frames_to_recover.worst, f.frames_to_recover.mean, context.options.seed + f.slowest,
                  f.frames_outside_999.worst);
}

/// Runs both modes and judges each trial by `judge(trial, contestant)`.
void run_adaptation(ExperimentContext& context, const std::string& title, const std::string& key,
                    const std::function<TrialSetting(std::uint64_t)>& setting_of,
                    const std::function<Recovery(const TrialRecord&, std::size_t)>& judge) {
  const std::vector<Contestant> contestants = stereo_contestants(context);
  const int trials = std::min(context.options.trials, kMostTrials);
  const auto records = run_trials(context, title, trials, setting_of, contestants);
  chart_errors(context, title, records, contestants, kLeft);
  context.table += fmt::format("\n{} ({} trials)\n", title, trials);
  for (std::size_t i = 0; i < contestants.size(); ++i) {
    std::vector<Recovery> recoveries;
    for (const auto& record : records) recoveries.push_back(judge(record, i));
    const RecoveryFigures figures = figures_of(recoveries);
    context.summary[modes()[i]][key] = to_json(figures);
    add_row(context, contestants[i].name, figures);
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
  const auto robot = setup.load();
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
