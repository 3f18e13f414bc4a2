#include "experiments.hpp"

#include <spdlog/fmt/fmt.h>

#include <atomic>
#include <cmath>
#include <mutex>
#include <random>
#include <thread>

#include "bodyschema/core/progress_bar.hpp"
#include "bodyschema/evaluation/statistics.hpp"

namespace bodyschema {
namespace {

constexpr int kLastFrames = 10;
constexpr int kLeft = 0;
constexpr int kRight = 1;
constexpr int kBackgroundFrames = 30;

const std::vector<std::string> kModes = {"best", "paper"};

EstimatorOptions options_for(const ExperimentContext& context, const std::string& mode) {
  EstimatorOptions options = EstimatorOptions::from(context.simulated);
  options.mode = mode == "paper" ? EstimatorMode::kPaper : EstimatorMode::kBest;
  return options;
}

struct ReachResult {
  Statistics position_mm, rotation_deg, frames_to_converge;
};

double mean_of_last(const std::vector<FrameRecord>& frames, int camera,
                    const std::array<double, 2> FrameRecord::*figure) {
  double sum = 0.0;
  int n = 0;
  for (std::size_t i = frames.size() - std::min<std::size_t>(kLastFrames, frames.size());
       i < frames.size(); ++i) {
    const double value = (frames[i].*figure)[static_cast<std::size_t>(camera)];
    if (value < 0.0) continue;
    sum += value;
    ++n;
  }
  return n > 0 ? sum / n : 0.0;
}

/// Frames until below 1 mm and 1 degree for good; all of them when that never happens.
double frames_to_converge(const std::vector<FrameRecord>& frames, int camera) {
  const auto c = static_cast<std::size_t>(camera);
  std::size_t last_bad = 0;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    if (frames[i].position_mm[c] >= 1.0 || frames[i].rotation_deg[c] >= 1.0) last_bad = i + 1;
  }
  return static_cast<double>(last_bad);
}

ReachResult reach_result(const std::vector<TrialRecord>& trials, std::size_t contestant,
                         int camera) {
  std::vector<double> position, rotation, frames;
  for (const auto& trial : trials) {
    const auto& record = trial.contestants[contestant].frames;
    if (record.empty()) continue;
    position.push_back(mean_of_last(record, camera, &FrameRecord::position_mm));
    rotation.push_back(mean_of_last(record, camera, &FrameRecord::rotation_deg));
    frames.push_back(frames_to_converge(record, camera));
  }
  return {Statistics::of(position), Statistics::of(rotation), Statistics::of(frames)};
}

Json to_json(const ReachResult& r) {
  const auto figures = [](const Statistics& s) {
    return Json{{"mean", s.mean}, {"sd", s.sd}, {"worst", s.worst}};
  };
  return {{"position_mm", figures(r.position_mm)},
          {"orientation_deg", figures(r.rotation_deg)},
          {"frames_to_converge", {{"mean", r.frames_to_converge.mean}}}};
}

void add_row(ExperimentContext& context, const std::string& name, const ReachResult& r) {
  context.table += fmt::format("{:<38} {:>5.2f} +- {:<5.2f} {:>5.2f} +- {:<5.2f} {:>6.2f} {:>6.2f} {:>7.1f}\n",
                               name, r.position_mm.mean, r.position_mm.sd, r.rotation_deg.mean,
                               r.rotation_deg.sd, r.position_mm.worst, r.rotation_deg.worst,
                               r.frames_to_converge.mean);
}

void add_heading(ExperimentContext& context, const std::string& title) {
  context.table += fmt::format("\n{:<38} {:>14} {:>14} {:>6} {:>6} {:>7}\n", title, "position mm",
                               "rotation deg", "worst", "worst", "frames");
}

/// Error of the hand over the frames, mean over trials (Figs. 6 and 8).
void chart_errors(ExperimentContext& context, const std::string& title,
                  const std::vector<TrialRecord>& trials, const std::vector<Contestant>& contestants,
                  int camera) {
  context.report.heading(title);
  struct Figure {
    const char* what;
    const char* unit;
    std::array<double, 2> FrameRecord::*values;
  };
  for (const Figure& figure : {Figure{"position error", "mm", &FrameRecord::position_mm},
                               Figure{"orientation error", "deg", &FrameRecord::rotation_deg}}) {
    Chart chart;
    chart.title = std::string(figure.what) + ", mean of " + std::to_string(trials.size()) + " trials";
    chart.x_label = "frame";
    chart.y_label = figure.unit;
    chart.logarithmic_y = true;
    for (std::size_t i = 0; i < contestants.size(); ++i) {
      ChartSeries series{contestants[i].name, {}, {}};
      for (std::size_t f = 0; f < trials.front().contestants[i].frames.size(); ++f) {
        std::vector<double> values;
        for (const auto& trial : trials) {
          if (f >= trial.contestants[i].frames.size()) continue;
          const double value = (trial.contestants[i].frames[f].*figure.values)[static_cast<std::size_t>(camera)];
          if (value >= 0.0) values.push_back(value);
        }
        if (values.empty()) continue;
        series.x.push_back(static_cast<double>(f));
        series.y.push_back(Statistics::of(values).mean);
      }
      chart.series.push_back(std::move(series));
    }
    context.report.chart(chart);
  }
}

/// Both modes on the same pictures; results under summary[mode][key].stereo.
void compare_modes(ExperimentContext& context, const std::string& title, const std::string& key,
                   int trials, const std::function<TrialSetting(std::uint64_t)>& setting_of,
                   int camera) {
  std::vector<Contestant> contestants;
  for (const auto& mode : kModes) {
    contestants.push_back({mode + ".stereo", options_for(context, mode), false});
  }
  const auto records = run_trials(context, title, trials, setting_of, contestants);
  add_heading(context, title);
  chart_errors(context, title, records, contestants, camera);
  for (std::size_t i = 0; i < contestants.size(); ++i) {
    const ReachResult result = reach_result(records, i, camera);
    context.summary[kModes[i]][key]["stereo"] = to_json(result);
    add_row(context, contestants[i].name, result);
    if (camera == kRight) {
      const ReachResult left = reach_result(records, i, kLeft);
      context.summary[kModes[i]][key]["stereo_left_eye"] = to_json(left);
      add_row(context, contestants[i].name + ", left eye", left);
    }
  }
}

/// How often `converged` came in time, and how often it was wrong.
void judge_converged(ExperimentContext& context, const std::vector<TrialRecord>& trials,
                     std::size_t contestant) {
  int in_time = 0;
  int converged_frames = 0;
  int false_frames = 0;
  for (const auto& trial : trials) {
    bool found = false;
    const auto& frames = trial.contestants[contestant].frames;
    for (std::size_t i = 0; i < frames.size(); ++i) {
      if (frames[i].state != EstimatorState::kConverged) continue;
      if (!found && i < 45) ++in_time;
      found = true;
      ++converged_frames;
      if (frames[i].position_mm[kLeft] > 2.0) ++false_frames;
    }
  }
  const double within = static_cast<double>(in_time) / static_cast<double>(trials.size());
  const double wrong = converged_frames > 0 ? static_cast<double>(false_frames) / converged_frames : 0.0;
  context.summary["best"]["converged"] = {{"within_45_rate", within}, {"false_rate", wrong}};
  context.table += fmt::format("state converged: within 45 frames in {:.0f} %, wrong (over 2 mm) in {:.2f} % of its frames\n",
                               100.0 * within, 100.0 * wrong);
}

simulator::FaultSpec fault(const std::string& name, const std::string& joint, double value) {
  return simulator::FaultSpec::of(name, joint, value);
}

}  // namespace

TrialSetting standard_setting(const ExperimentContext& context) {
  TrialSetting setting{context.simulated,
                       simulator::SimulatorSettings::from(context.simulated.section("simulator")),
                       {},
                       {}};
  setting.simulator.background_frames = kBackgroundFrames;
  setting.simulator.entry_frames = 0;
  setting.simulator.clutter = false;
  setting.plan.frames = 100;
  setting.plan.offsets_deg = {{"r_shoulder_pitch", 5}, {"r_shoulder_roll", 4},
                              {"r_shoulder_yaw", 3},   {"r_elbow", -2},
                              {"r_wrist_prosup", 3},   {"r_wrist_pitch", -7},
                              {"r_wrist_yaw", 3}};
  return setting;
}

std::vector<TrialRecord> run_trials(const ExperimentContext& context, const std::string& label,
                                    int trials,
                                    const std::function<TrialSetting(std::uint64_t)>& setting_of,
                                    const std::vector<Contestant>& contestants) {
  std::vector<TrialRecord> records(static_cast<std::size_t>(trials));
  // Configuration is read by one thread only: settings are made before the work is shared out.
  std::vector<TrialSetting> settings;
  for (int t = 0; t < trials; ++t) {
    settings.push_back(setting_of(context.options.seed + static_cast<std::uint64_t>(t)));
  }
  ProgressBar bar(label, static_cast<std::uint64_t>(trials));
  std::atomic<int> next{0};
  std::mutex mutex;
  std::exception_ptr failure;
  const auto work = [&] {
    for (int t = next++; t < trials; t = next++) {
      try {
        const auto index = static_cast<std::size_t>(t);
        records[index] =
            run_trial(settings[index], contestants, context.options.seed + static_cast<std::uint64_t>(t));
        const std::lock_guard lock(mutex);
        bar.advance();
      } catch (...) {
        const std::lock_guard lock(mutex);
        if (!failure) failure = std::current_exception();
        next = trials;
      }
    }
  };
  int count = context.options.threads > 0
                  ? context.options.threads
                  : static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  count = std::min(count, trials);
  std::vector<std::thread> threads;
  for (int i = 1; i < count; ++i) threads.emplace_back(work);
  work();
  for (auto& thread : threads) thread.join();
  if (failure) std::rethrow_exception(failure);
  return records;
}

void run_experiment1(ExperimentContext& context, bool paper_only) {
  std::vector<Contestant> contestants;
  for (const auto& mode : kModes) {
    if (paper_only && mode != "paper") continue;
    contestants.push_back({mode + ".stereo", options_for(context, mode), false});
    contestants.push_back({mode + ".mono", options_for(context, mode), true});
  }
  const auto records = run_trials(context, "experiment 1: offsets in the arm", context.options.trials,
                                  [&](std::uint64_t) { return standard_setting(context); }, contestants);
  add_heading(context, "experiment 1: offsets in the arm");
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
  context.table += fmt::format("{:<38} {:>5.2f} +- {:<5.2f} {:>5.2f} +- {:<5.2f}\n",
                               "Table I of the paper (stereo)", 3.34, 1.52, 4.55, 2.03);
  if (!paper_only) judge_converged(context, records, 0);
}

void run_clutter(ExperimentContext& context) {
  compare_modes(context, "experiment 1 before clutter", "experiment1_clutter", context.options.trials,
                [&](std::uint64_t) {
                  TrialSetting setting = standard_setting(context);
                  setting.simulator.clutter = true;
                  return setting;
                },
                kLeft);
}

void run_mismatch(ExperimentContext& context) {
  compare_modes(context, "model mismatch", "mismatch", context.options.trials,
                [&](std::uint64_t seed) {
                  TrialSetting setting = standard_setting(context);
                  std::mt19937_64 random(seed * 7919u + 3u);
                  const auto sign = [&] { return (random() & 1u) != 0 ? 1.0 : -1.0; };
                  auto& faults = setting.plan.faults;
                  faults.push_back(fault("focal_length", "", 0.3 * sign()));
                  for (const char* source : {"left", "right"}) {
                    for (const char* axis : {"x", "y"}) {
                      simulator::FaultSpec shift{"principal_point", {{"source", source}, {"axis", axis}}};
                      shift.set("value", 0.5 * sign());
                      faults.push_back(shift);
                    }
                  }
                  faults.push_back(fault("mesh_scale", "", 0.5 * sign()));
                  faults.push_back(fault("finger_posture", "", 2.0 * sign()));
                  return setting;
                },
                kLeft);
}

void run_experiment2(ExperimentContext& context) {
  compare_modes(context, "experiment 2: offsets in arm and head", "experiment2", context.options.trials,
                [&](std::uint64_t) {
                  TrialSetting setting = standard_setting(context);
                  setting.plan.faults = {fault("head_offset", "neck_pitch", -4),
                                         fault("head_offset", "neck_roll", 6),
                                         fault("head_offset", "neck_yaw", -2),
                                         fault("head_offset", "eyes_tilt", -1)};
                  return setting;
                },
                kRight);
}

void run_offsets(ExperimentContext& context) {
  constexpr int kLogs = 6;
  const std::vector<Contestant> contestants = {{"best.stereo", options_for(context, "best"), false},
                                               {"paper.stereo", options_for(context, "paper"), false}};
  const auto records = run_trials(context, "offsets after 60 s of babbling", kLogs,
                                  [&](std::uint64_t seed) {
                                    TrialSetting setting = standard_setting(context);
                                    setting.plan.motion = simulator::Motion::kBabble;
                                    setting.plan.seconds = 60.0;
                                    std::mt19937_64 random(seed * 104729u + 11u);
                                    std::normal_distribution<double> normal(0.0, 4.0);
                                    for (auto& [joint, offset] : setting.plan.offsets_deg) offset = normal(random);
                                    return setting;
                                  },
                                  contestants);
  context.table += "\noffsets after 60 s of babbling\n";
  for (std::size_t i = 0; i < contestants.size(); ++i) {
    double squares = 0.0;
    int covered = 0;
    int n = 0;
    std::vector<double> half_widths;
    for (const auto& record : records) {
      const FrameRecord& last = record.contestants[i].frames.back();
      for (Eigen::Index k = 0; k < last.offset_deg.size(); ++k) {
        const double error = last.offset_deg(k) - record.true_offset_deg(k);
        const double half_width = 1.96 * std::sqrt(std::max(0.0, last.covariance_deg2(k, k)));
        squares += error * error;
        covered += std::abs(error) <= half_width ? 1 : 0;
        half_widths.push_back(half_width);
        ++n;
      }
    }
    const double rms = std::sqrt(squares / n);
    const double coverage = static_cast<double>(covered) / n;
    const double half_width = Statistics::of(half_widths).median;
    context.summary[kModes[i]]["offsets"] = {
        {"rms_deg", rms}, {"coverage95", coverage}, {"half_width95_median_deg", half_width}};
    context.table += fmt::format("{:<38} rms {:.3f} deg, 95 % intervals cover {:.0f} %, median half-width {:.3f} deg\n",
                                 contestants[i].name, rms, 100.0 * coverage, half_width);
  }
  context.table += "weakest direction of the last log: " + records.back().contestants[0].weakest.text + '\n';
}

void run_slip(ExperimentContext& context) {
  const std::vector<Contestant> contestants = {{"best.stereo", options_for(context, "best"), false}};
  const int trials = std::min(context.options.trials, 14);
  const std::vector<std::string> joints = {"r_shoulder_pitch", "r_shoulder_roll", "r_shoulder_yaw", "r_elbow",
                                           "r_wrist_prosup",   "r_wrist_pitch",   "r_wrist_yaw"};
  constexpr int kSlipFrame = 45;
  const auto records = run_trials(context, "a joint slips by 5 degrees", trials,
                                  [&](std::uint64_t seed) {
                                    TrialSetting setting = standard_setting(context);
                                    auto slip = fault("slip", joints[seed % joints.size()], seed % 2 == 0 ? 5.0 : -5.0);
                                    slip.set("at", kSlipFrame / setting.simulator.camera_rate_hz);
                                    setting.plan.faults = {slip};
                                    return setting;
                                  },
                                  contestants);
  chart_errors(context, "a joint slips by 5 degrees", records, contestants, kLeft);
  std::vector<double> recovery;
  std::vector<double> dishonest;
  std::string by_joint;
  for (const auto& record : records) {
    const auto& frames = record.contestants[0].frames;
    double last_bad = 0.0;
    double outside = 0.0;
    for (std::size_t i = kSlipFrame; i < frames.size(); ++i) {
      if (frames[i].position_mm[kLeft] >= 1.0) last_bad = static_cast<double>(i - kSlipFrame + 1);
      // 99.9 % of a 3-D normal lies within 4.03 sd along one axis; hand_sd adds the three axes.
      if (frames[i].position_mm[kLeft] > 4.03 * frames[i].hand_sd_mm) ++outside;
    }
    recovery.push_back(last_bad);
    dishonest.push_back(outside);
    by_joint += fmt::format("  {} {:.0f}", joints[record.seed % joints.size()], last_bad);
  }
  const Statistics r = Statistics::of(recovery);
  const Statistics d = Statistics::of(dishonest);
  context.summary["best"]["slip"] = {{"frames_to_recover", {{"mean", r.mean}, {"max", r.worst}}},
                                     {"frames_outside_999", {{"mean", d.mean}, {"max", d.worst}}}};
  context.table += fmt::format("\na joint slips by 5 degrees: below 1 mm again within {:.0f} frames (mean {:.1f}); truth outside the published 99.9 % region for at most {:.0f} frames\n",
                               r.worst, r.mean, d.worst);
  context.table += "frames by joint:" + by_joint + '\n';
}

namespace {

/// The arm moves from where it is until the corrected model sees the hand at `target_C` in the left
/// eye: least change of the joints, by Newton steps. Encoder readings, radians.
Eigen::VectorXd correct_reach(Estimator& estimator, const std::vector<Eigen::Index>& joints,
                              Eigen::VectorXd q, const Eigen::Vector3d& target_C) {
  constexpr double kStep = 1e-5;
  Eigen::Matrix<double, 3, Eigen::Dynamic> J(3, static_cast<Eigen::Index>(joints.size()));
  for (int iteration = 0; iteration < 15; ++iteration) {
    const Eigen::Vector3d hand = estimator.hand_pose(q, 0, true).translation();
    for (std::size_t k = 0; k < joints.size(); ++k) {
      Eigen::VectorXd moved = q;
      moved(joints[k]) += kStep;
      J.col(static_cast<Eigen::Index>(k)) =
          (estimator.hand_pose(moved, 0, true).translation() - hand) / kStep;
    }
    const Eigen::VectorXd step = J.completeOrthogonalDecomposition().solve(target_C - hand);
    for (std::size_t k = 0; k < joints.size(); ++k) q(joints[k]) += step(static_cast<Eigen::Index>(k));
  }
  return q;
}

}  // namespace

void run_reach(ExperimentContext& context) {
  // The ballistic reach ends where the nominal model believes the target to be; what it missed by is
  // the nominal figure. Then the arm corrects once, with what was learned on the way.
  const std::vector<Contestant> contestants = {{"best.stereo", options_for(context, "best"), false},
                                               {"paper.stereo", options_for(context, "paper"), false}};
  const RobotSetup setup = RobotSetup::from(context.simulated.section("robot"));
  TrialSetting reach = standard_setting(context);
  reach.on_end = [names = setup.estimated_joints](Estimator& estimator, const RobotModel& robot,
                                                  const Eigen::VectorXd& q, TrialRecord& trial,
                                                  std::size_t contestant) {
    std::vector<Eigen::Index> joints;
    for (const auto& name : names) joints.push_back(robot.joint_index(name));
    const Eigen::Vector3d target_C = estimator.hand_pose(q, 0, false).translation();
    Eigen::VectorXd q_true = correct_reach(estimator, joints, q, target_C);
    for (std::size_t k = 0; k < joints.size(); ++k) {
      q_true(joints[k]) -= radians(trial.true_offset_deg(static_cast<Eigen::Index>(k)));
    }
    trial.contestants[contestant].reach_miss_mm =
        1e3 * (estimator.hand_pose(q_true, 0, false).translation() - target_C).norm();
  };
  const auto records = run_trials(context, "reach to a target", context.options.trials,
                                  [&](std::uint64_t) { return reach; }, contestants);
  std::vector<double> nominal_mm;
  for (const auto& record : records) {
    nominal_mm.push_back(record.contestants[0].frames.back().nominal_mm[kLeft]);
  }
  const double nominal = Statistics::of(nominal_mm).median;
  context.table += fmt::format("\nreach to a target, hand to target, median: nominal model {:.1f} mm", nominal);
  for (std::size_t i = 0; i < contestants.size(); ++i) {
    std::vector<double> corrected_mm;
    for (const auto& record : records) corrected_mm.push_back(record.contestants[i].reach_miss_mm);
    const double median = Statistics::of(corrected_mm).median;
    context.summary[kModes[i]]["reach"] = {{"median_mm", median}, {"improvement", nominal / std::max(median, 1e-9)}};
    context.table += fmt::format(", {} {:.2f} mm", kModes[i], median);
  }
  context.table += '\n';
}

}  // namespace bodyschema
