#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "bodyschema/core/error.hpp"
#include "bodyschema/core/progress_bar.hpp"
#include "bodyschema/evaluation/everyday.hpp"
#include "bodyschema/evaluation/statistics.hpp"
#include "bodyschema/pipeline/pipeline.hpp"
#include "bodyschema/simulator/scenes.hpp"
#include "bodyschema/simulator/simulator.hpp"
#include "experiments.hpp"
#include "in_parallel.hpp"

/// What pictures of a working laboratory do to the whole chain, from picture to estimate: each row is one condition,
/// played by the simulator, and nobody tells the estimator which.
namespace bodyschema {
namespace {

namespace fs = std::filesystem;

constexpr double kPictureRate_hz = 10.0;
constexpr int kPostures = 8;
constexpr double kLargestOffset_deg = 5.0;
/// Methods that must be shown a background get it from pictures of the empty room; the others start with the arm in
/// view.
constexpr int kEmptyRoomFrames = 30;
constexpr int kFirstCounted = 45;  ///< frames; time to converge
constexpr std::size_t kLastFrames = 50;
/// Beyond these a converged frame is wrong: by chance one frame in 400, or one offset in two million, is.
constexpr double kWrongHand_sd = 3.0, kWrongHand_mm = 2.0, kWrongOffset_sd = 5.0;

struct EverydayRow {
  const char* name;
  const char* scene;
  bool lens_known = false;    ///< the configuration has what the lens does
  bool lens_unknown = false;  ///< nobody calibrated it, and the configuration says so
};
constexpr std::array<EverydayRow, 13> kEverydayRows = {{{"plain", "plain"},
                                                        {"room", "room"},
                                                        {"head", "head"},
                                                        {"materials", "materials"},
                                                        {"light", "light"},
                                                        {"object", "object"},
                                                        {"object_part", "object_part"},
                                                        {"person", "person"},
                                                        {"shutter", "shutter"},
                                                        {"lens", "plain", true},
                                                        {"lens_forgotten", "lens_forgotten", false, true},
                                                        {"jpeg", "jpeg"},
                                                        {"all", "kitchen"}}};

struct EverydayRun {
  const EverydayRow* row;
  std::string robot;  ///< folder of its configuration
  std::uint64_t seed;
};

std::map<std::string, double> drawn_offsets(const std::vector<std::string>& joints, std::uint64_t seed) {
  std::mt19937_64 random(seed * 6364136223846793005u + 11u);
  std::uniform_real_distribution<double> offset(-kLargestOffset_deg, kLargestOffset_deg);
  std::map<std::string, double> drawn;
  for (const auto& joint : joints) drawn[joint] = offset(random);
  return drawn;
}

bool in_picture(const CameraModel& camera, const Pose& X_CP) {
  const Eigen::Vector3d p = X_CP.translation();
  if (p.z() <= 0.0) return false;
  const auto& k = camera.intrinsics;
  const Eigen::Vector2d pixel = k.project(p);
  const double u = pixel.x(), v = pixel.y();
  return u >= 0.0 && v >= 0.0 && u < k.width && v < k.height;
}

EverydayFrame frame_of(const Estimate& estimate, const simulator::SimulatedFrame& truth, const CameraModel& camera,
                       const std::map<std::string, double>& offsets_deg) {
  EverydayFrame frame;
  frame.converged = estimate.state == EstimatorState::kConverged;
  frame.in_view = in_picture(camera, truth.truth[0].X_CP);
  if (estimate.X_CP.empty()) return frame;
  frame.hand_mm = 1e3 * (estimate.X_CP[0].translation() - truth.truth[0].X_CP.translation()).norm();
  frame.hand_sd_mm = 1e3 * estimate.hand_sd_m;
  for (std::size_t k = 0; k < estimate.joint_names.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    const double sd_deg = degrees(std::sqrt(std::max(1e-12, estimate.covariance_rad2(i, i))));
    const double error_deg = degrees(estimate.offset_rad(i)) - offsets_deg.at(estimate.joint_names[k]);
    frame.offset_sd = std::max(frame.offset_sd, std::abs(error_deg) / sd_deg);
  }
  return frame;
}

std::vector<EverydayFrame> play(const ExperimentContext& context, const EverydayRun& job) {
  // A configuration of its own: they are read by one thread.
  // One method throughout, that nobody has to choose; --set vision.method compares others.
  std::vector<std::string> overrides = {"vision.method=auto"};
  overrides.insert(overrides.end(), context.options.overrides.begin(), context.options.overrides.end());
  overrides.push_back("filter.seed=" + std::to_string(job.seed * 1000003u + 17u));
  overrides.emplace_back("silhouette.threads=1");
  for (const std::string camera : {"left", "right"}) {  // what a lab knows of its cameras, whatever the row plays
    overrides.push_back("cameras." + camera + ".distortion=[0, 0, 0, 0, 0]");
    overrides.push_back("cameras." + camera + ".readout_ms=unknown");
  }
  if (job.row->lens_known) {
    // The simulator draws through the lenses of its configuration; so does the estimator's then.
    overrides.emplace_back("cameras.left.distortion=[-0.3, 0, 0, 0, 0]");
    overrides.emplace_back("cameras.right.distortion=[-0.3, 0, 0, 0, 0]");
  }
  if (job.row->lens_unknown) {
    overrides.emplace_back("cameras.left.distortion=unknown");
    overrides.emplace_back("cameras.right.distortion=unknown");
  }
  const auto configuration = Configuration::load(context.recorded / job.robot / "evaluation.yaml", overrides);
  Pipeline pipeline(configuration);
  auto settings = simulator::SimulatorSettings::from(configuration.section("simulator"));
  settings.camera_rate_hz = kPictureRate_hz;
  settings.motion.postures = kPostures;
  settings.entry_frames = 0;
  settings.background_frames = pipeline.needs_background() ? kEmptyRoomFrames : 0;
  simulator::apply_scene(settings, job.row->scene);

  simulator::SimulationPlan plan;
  plan.seed = job.seed;
  plan.motion = simulator::Motion::kBabble;
  plan.seconds = context.options.everyday_s;
  plan.offsets_deg = drawn_offsets(pipeline.setup().estimated_joints, job.seed);
  simulator::Simulator simulator(pipeline.shared_robot(), pipeline.setup(), pipeline.rig(), settings, plan);
  std::vector<JointSample> history;
  std::vector<EverydayFrame> frames;
  while (auto frame = simulator.next()) {
    history.insert(history.end(), frame->encoders.begin(), frame->encoders.end());
    if (history.size() > 400) history.erase(history.begin(), history.end() - 200);
    Observation observation = simulator::to_observation(*frame, history);
    observation.encoders = frame->encoders;
    const Estimate estimate = pipeline.process(observation);
    if (frame->phase != simulator::Phase::kMotion) continue;
    frames.push_back(frame_of(estimate, *frame, pipeline.rig().cameras[0], plan.offsets_deg));
  }
  return frames;
}

/// Runs the jobs on as many threads as the options say; results in their order.
std::vector<EverydayLog> play_all(const ExperimentContext& context, const std::vector<EverydayRun>& jobs) {
  std::vector<EverydayLog> logs(jobs.size());
  ProgressBar bar("everyday pictures", jobs.size());
  in_parallel(jobs.size(), context.options.threads, [&](std::size_t i) {
    logs[i] = judge_everyday(play(context, jobs[i]), kFirstCounted);
    bar.advance(1);
  });
  return logs;
}

}  // namespace

EverydayLog judge_everyday(const std::vector<EverydayFrame>& frames, int first_counted) {
  EverydayLog log;
  double sum_mm = 0.0;
  for (std::size_t i = static_cast<std::size_t>(first_counted); i < frames.size(); ++i) {
    const auto& frame = frames[i];
    if (!frame.in_view) continue;
    ++log.counted;
    if (!frame.converged) continue;
    ++log.converged;
    sum_mm += frame.hand_mm;
    const bool hand_wrong = frame.hand_mm > kWrongHand_mm && frame.hand_mm > kWrongHand_sd * frame.hand_sd_mm;
    log.dishonest += hand_wrong || frame.offset_sd > kWrongOffset_sd;
  }
  if (log.converged > 0) {
    log.hand_mm = sum_mm / log.converged;
    return log;
  }
  const std::size_t first = frames.size() > kLastFrames ? frames.size() - kLastFrames : 0;
  double known = 0.0;
  for (std::size_t i = first; i < frames.size(); ++i) {
    if (frames[i].hand_mm < 0.0) continue;
    sum_mm += frames[i].hand_mm;
    known += 1.0;
  }
  log.hand_mm = known > 0.0 ? sum_mm / known : 0.0;
  return log;
}

void run_everyday(ExperimentContext& context) {
  std::vector<std::string> names;
  for (const auto& row : kEverydayRows) names.emplace_back(row.name);
  check_rows(context.options, names);
  const bool among_all = context.options.experiment == "all";
  const int trials = among_all ? std::min(context.options.trials, kMostEverydayTrials) : context.options.trials;
  const bool official = !context.options.data.empty() && fs::exists(context.options.data / "icub-models");
  std::vector<EverydayRun> jobs;
  for (const auto& row : kEverydayRows) {
    if (!is_asked_for(context.options, row.name)) continue;
    for (int t = 0; t < trials; ++t) {
      const bool theirs = official && t % 2 == 1;
      jobs.push_back({&row, theirs ? "icub_v2_5" : "icub_right", context.options.seed + static_cast<std::uint64_t>(t)});
    }
  }
  const auto logs = play_all(context, jobs);
  context.table += fmt::format(
      "\neveryday pictures ({} seeds a row, {}; {:.0f} s at {:.0f} Hz)\n{:<16} {:>9} {:>9} {:>10} {:>10} {:>10}\n",
      trials, official ? "own and official iCub in turn" : "own iCub", context.options.everyday_s, kPictureRate_hz,
      "row", "hand, mm", "worst", "converged", "dishonest", "in logs");
  auto& out = context.summary["everyday"];
  for (std::size_t begin = 0; begin < logs.size(); begin += static_cast<std::size_t>(trials)) {
    std::vector<double> hand_mm;
    double converged = 0.0, of_converged = 0.0, dishonest = 0.0;
    int logs_dishonest = 0;
    for (std::size_t i = begin; i < begin + static_cast<std::size_t>(trials); ++i) {
      hand_mm.push_back(logs[i].hand_mm);
      converged += logs[i].counted > 0 ? static_cast<double>(logs[i].converged) / logs[i].counted : 0.0;
      of_converged += logs[i].converged;
      dishonest += logs[i].dishonest;
      logs_dishonest += logs[i].dishonest > 0;
    }
    const auto hand = Statistics::of(hand_mm);
    const double converged_rate = converged / trials,
                 dishonest_rate = of_converged > 0.0 ? dishonest / of_converged : 0.0;
    const char* name = jobs[begin].row->name;
    out[name] = {{"hand_mm", {{"mean", hand.mean}, {"sd", hand.sd}, {"worst", hand.worst}}},
                 {"converged_rate", converged_rate},
                 {"dishonest_rate", dishonest_rate},
                 {"dishonest_logs", logs_dishonest},
                 {"seeds", trials},
                 {"hand_mm_by_seed", hand_mm}};
    context.table += fmt::format("{:<16} {:>9.2f} {:>9.2f} {:>9.0f}% {:>9.1f}% {:>7}/{}\n", name, hand.mean, hand.worst,
                                 100.0 * converged_rate, 100.0 * dishonest_rate, logs_dishonest, trials);
  }
}

}  // namespace bodyschema
