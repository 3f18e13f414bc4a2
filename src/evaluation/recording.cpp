#include <spdlog/fmt/fmt.h>

#include "bodyschema/bus/log.hpp"
#include "bodyschema/imports/yarp_import.hpp"
#include "bodyschema/core/error.hpp"
#include "bodyschema/core/progress_bar.hpp"
#include "bodyschema/diagnosis/log_diagnosis.hpp"
#include "bodyschema/evaluation/statistics.hpp"
#include "bodyschema/pipeline/hand_errors.hpp"
#include "bodyschema/pipeline/overlay.hpp"
#include "bodyschema/pipeline/pipeline.hpp"
#include "bodyschema/pipeline/truth.hpp"
#include "experiments.hpp"
#include "honesty_figures.hpp"
#include "official_hand.hpp"
#include "scratch.hpp"

namespace bodyschema {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kLastPoses = 30;
constexpr const char* kOfficialRobot = "icub-models/iCub_manual/robots/iCubGazeboV2_5_visuomanip/model.urdf";
/// The official iCub is a newer robot: its hand sits this much further out than the recording's.
constexpr double kOfficialHandFurther_m = 0.00998;

/// Errors of the fingertips over the poses of the recording, both cameras pooled.
struct TipErrors {
  double px = 0.0;
  double mm = 0.0;
  double hand_deg = 0.0;
};

struct RecordingResult {
  TipErrors uncorrected;   ///< encoders as they are, all poses
  TipErrors final;         ///< the last estimate applied to all poses
  double online_px = 0.0;  ///< each estimate at its time, last 30 poses
  std::vector<std::string> joint_names;
  std::vector<Eigen::VectorXd> offsets;  ///< deg, frame by frame (Fig. 9)
  HonestyLog honesty;                    ///< frame by frame
  Image overlay;                         ///< last frame with and without correction (Fig. 10)
};

/// What the diagnosis of the log makes of a configuration: its extended model, in `out`.
fs::path diagnose_into(const Configuration& configuration, const fs::path& log, const fs::path& out) {
  LogDiagnosisOptions options;
  options.log = log;
  options.out = out;
  diagnose_log(configuration, options);
  return out / "extended_model.yaml";
}

/// The choices about estimating. Robot, cameras and bus of the recording are its own.
std::vector<std::string> about_estimating(const std::vector<std::string>& overrides) {
  std::vector<std::string> chosen;
  for (const auto& one : overrides) {
    const std::string section = one.substr(0, one.find_first_of(".="));
    if (section == "robot" || section == "cameras" || section == "bus" || section == "simulator") continue;
    chosen.push_back(one);
  }
  return chosen;
}

/// A choice of the command line that sets a file.
std::string set(const char* key, const fs::path& file) {
  return fmt::format("{}='{}'", key, file.string());
}

void show(ExperimentContext& context, const std::string& title, const RecordingResult& result) {
  context.report.heading("recording: " + title);
  Chart chart;
  chart.title = "estimated offsets";
  chart.x_label = "frame";
  chart.y_label = "deg";
  for (std::size_t k = 0; k < result.joint_names.size(); ++k) {
    ChartSeries series{result.joint_names[k], {}, {}};
    for (std::size_t f = 0; f < result.offsets.size(); ++f) {
      series.x.push_back(static_cast<double>(f));
      series.y.push_back(result.offsets[f](static_cast<Eigen::Index>(k)));
    }
    chart.series.push_back(std::move(series));
  }
  context.report.chart(chart);
  context.report.picture(result.overlay, title + ": the encoders as they are (red), corrected (green)");
}

/// What was published of one frame against the recording's truth, in the first camera.
HonestyFrame honesty_of(const Estimate& estimate, const Observation& observation, const Truth& truth) {
  HonestyFrame frame;
  frame.converged = estimate.state == EstimatorState::kConverged;
  frame.in_view = true;
  frame.hand_sd_mm = 1e3 * estimate.hand_sd_m;
  const auto* instant = observation.cameras[0] ? truth.at(observation.cameras[0]->utime) : nullptr;
  if (instant != nullptr) {
    frame.hand_error_mm = 1e3 * (estimate.X_CP[0].translation() - instant->X_CP[0].translation()).norm();
  }
  frame.offset_error_deg = estimate.offset_rad * (180.0 / kPi);
  frame.offset_sd_deg = estimate.covariance_rad2.diagonal().cwiseMax(0.0).cwiseSqrt() * (180.0 / kPi);
  for (std::size_t k = 0; k < estimate.joint_names.size(); ++k) {
    for (const auto& [joint, offset] : truth.offsets()) {
      if (joint == estimate.joint_names[k]) frame.offset_error_deg[static_cast<Eigen::Index>(k)] -= degrees(offset);
    }
  }
  return frame;
}

RecordingResult watch(const Configuration& configuration, const fs::path& log, const Truth& truth,
                      const std::string& label) {
  Pipeline pipeline(configuration);
  ObservationStream stream = pipeline.make_stream();
  struct Seen {
    std::size_t camera;
    Microseconds utime;
    Exposure at;
  };
  std::vector<Seen> seen;
  std::vector<std::pair<Microseconds, double>> online;
  Estimate last;
  std::optional<Observation> last_view;
  std::vector<Eigen::VectorXd> offsets;
  HonestyLog honesty;
  const auto take = [&](Observation& observation) {
    last = pipeline.process(observation);
    offsets.push_back(last.offset_rad * (180.0 / kPi));
    honesty.push_back(honesty_of(last, observation, truth));
    for (std::size_t c = 0; c < observation.cameras.size(); ++c) {
      if (!observation.cameras[c]) continue;
      const auto& picture = *observation.cameras[c];
      seen.push_back({c, picture.utime, pipeline.estimator().exposure(c)});
      if (const TruthInstant* instant = truth.at(picture.utime)) {
        online.emplace_back(instant->begin,
                            hand_error(last.X_CP[c], *instant, c, pipeline.rig().cameras[c].intrinsics).fingertip_px);
      }
    }
    last_view = std::move(observation);
  };
  LogReader reader(log);
  ProgressBar bar(label, reader.size());
  LogEvent event;
  while (reader.next(event)) {
    if (stream.receive(event.channel, event.data, event.time_us)) {
      while (auto arrived = stream.next()) take(arrived->observation);
    }
    bar.set(reader.position());
  }
  stream.finish();
  while (auto arrived = stream.next()) take(arrived->observation);
  if (seen.empty()) throw DataError(log.string() + ": no synchronised pictures in the recording");

  RecordingResult result;
  auto views = overlay_views(pipeline, *last_view, last);
  crop_to_arm(views);
  result.overlay = draw_overlay(views, label);
  result.offsets = std::move(offsets);
  result.honesty = std::move(honesty);
  result.joint_names = last.joint_names;
  std::vector<double> before_px, before_mm, before_deg, after_px, after_mm, after_deg, online_px;
  for (const auto& frame : seen) {
    const TruthInstant* instant = truth.at(frame.utime);
    if (instant == nullptr) continue;
    const auto& intrinsics = pipeline.rig().cameras[frame.camera].intrinsics;
    const auto before = hand_error(pipeline.estimator().hand_pose(frame.at, false), *instant, frame.camera, intrinsics);
    const auto after = hand_error(pipeline.estimator().hand_pose(frame.at, true), *instant, frame.camera, intrinsics);
    before_px.push_back(before.fingertip_px);
    before_mm.push_back(1e3 * before.fingertip_m);
    before_deg.push_back(degrees(before.rotation_rad));
    after_deg.push_back(degrees(after.rotation_rad));
    after_px.push_back(after.fingertip_px);
    after_mm.push_back(1e3 * after.fingertip_m);
  }
  const auto& instants = truth.instants();
  const Microseconds from = instants[instants.size() - std::min(kLastPoses, instants.size())].begin;
  for (const auto& [time, px] : online) {
    if (time >= from) online_px.push_back(px);
  }
  result.uncorrected = {Statistics::of(before_px).mean, Statistics::of(before_mm).mean,
                        Statistics::of(before_deg).mean};
  result.final = {Statistics::of(after_px).mean, Statistics::of(after_mm).mean, Statistics::of(after_deg).mean};
  result.online_px = Statistics::of(online_px).mean;
  return result;
}

}  // namespace

void run_recording(ExperimentContext& context, bool only_honesty) {
  const fs::path data = context.options.data.empty() ? fs::path() : fs::weakly_canonical(context.options.data);
  const fs::path recording = data / "eyehand-sim";
  if (data.empty() || !fs::exists(recording / "truth.json")) {
    context.table += "\nrecording: skipped, no eyehand-sim/truth.json in '" + data.string() + "' (BODYSCHEMA_DATA)\n";
    return;
  }
  const Truth truth = Truth::load(recording / "truth.json");
  // One log for every robot: the official hand's joints are added to the recording's own.
  const Configuration import = Configuration::load(context.recorded / "icub_unity/import_official_hand.yaml");
  const Scratch log("recording.log");
  const BusOptions bus = BusOptions::from(import.section("bus"));
  import_yarp(recording / "yarp", YarpImportOptions::from(import.section("yarp_import")), bus.channels(), log.path());
  const Scratch official_hand("official_hand.urdf");
  const fs::path exact_urdf = recording / "robot/icub_unity.urdf", nominal_urdf = recording / "robot/icub_v1.urdf";
  write_grafted_urdf({.arm_urdf = exact_urdf,
                      .hand_urdf = data / kOfficialRobot,
                      .arm_link = "r_hand",
                      .hand_root = "r_hand",
                      .hand_frame = "r_hand_dh_frame",
                      .along_z_m = kOfficialHandFurther_m,
                      .prefix = "official_"},
                     official_hand.path());

  context.table += fmt::format("\n{:<38} {:>16} {:>16} {:>9} {:>12}\n", "recording, fingertips", "uncorrected px/mm",
                               "final px/mm", "hand deg", "last 30 px");
  // The configurations look for the data where BODYSCHEMA_DATA says; here it is where the caller says.
  const std::vector<std::string> backgrounds = {
      set("vision.background_pictures.left", recording / "background_left.png"),
      set("vision.background_pictures.right", recording / "background_right.png")};
  struct Case {
    const char* key;
    const char* file;
    const char* title;
    std::vector<std::string> overrides{};
    std::vector<std::string> modes = {"best", "paper"};
    bool diagnosed = false;  ///< extended by what the diagnosis finds in the same log
  };
  for (const Case& robot :
       {Case{"exact", "icub_unity/estimator.yaml", "exact robot", {set("robot.urdf", exact_urdf)}},
        Case{"icub_hand",
             "icub_unity/estimator_official_hand.yaml",
             "official hand",
             {set("robot.urdf", official_hand.path()),
              fmt::format("robot.mesh_search_roots=['{}', '{}']", (data / "icub-models").string(),
                          exact_urdf.parent_path().string())}},
        Case{"nominal", "icub_unity/estimator_v1.yaml", "nominal robot (icub_v1)", {set("robot.urdf", nominal_urdf)}},
        Case{"nominal_diagnosed",
             "icub_unity/estimator_v1.yaml",
             "nominal robot, diagnosed",
             {set("robot.urdf", nominal_urdf)},
             {"best"},
             true}}) {
    // What is wrong with these is known, and what the estimator says of itself there: never `converged` while wrong.
    const bool asked = robot.key == std::string("nominal") || robot.key == std::string("icub_hand");
    if (only_honesty && !asked) continue;
    std::vector<std::string> choices = robot.overrides;
    choices.insert(choices.end(), backgrounds.begin(), backgrounds.end());
    const auto wishes = about_estimating(context.options.overrides);
    choices.insert(choices.end(), wishes.begin(), wishes.end());
    if (robot.diagnosed) {
      const auto model = diagnose_into(Configuration::load(context.recorded / robot.file, choices), log.path(),
                                       context.options.out / "recording_nominal_diagnosis");
      choices.push_back(set("robot.extended_model", fs::absolute(model)));
    }
    for (const auto& mode : only_honesty ? std::vector<std::string>{"best"} : robot.modes) {
      // The published filter is random: its figure is the median of ten seeds.
      const int seeds = mode == "paper" ? 10 : 1;
      std::vector<double> px, mm, deg, online;
      RecordingResult result;
      for (int seed = 1; seed <= seeds; ++seed) {
        std::vector<std::string> overrides = choices;
        overrides.push_back("estimator.mode=" + mode);
        overrides.push_back("filter.seed=" + std::to_string(seed));
        if (mode == "paper") overrides.push_back("filter.initial_sd_deg=10");
        result = watch(Configuration::load(context.recorded / robot.file, overrides), log.path(), truth,
                       fmt::format("recording, {}, {} {}/{}", robot.title, mode, seed, seeds));
        px.push_back(result.final.px);
        mm.push_back(result.final.mm);
        deg.push_back(result.final.hand_deg);
        online.push_back(result.online_px);
      }
      if (mode == "best") {
        const auto honest = honesty_figures({&result.honesty});
        context.summary["honesty"][std::string("recording_") + robot.key] = to_json(honest);
        context.table += fmt::format("{:<38} converged in {:.0f} % of the frames, wrong in {:.1f} % of these\n",
                                     robot.title, 100.0 * honest.converged_rate, 100.0 * honest.dishonest_frame_rate);
      }
      if (only_honesty) continue;
      show(context, fmt::format("{}, {}", robot.title, mode), result);
      const double final_px = Statistics::of(px).median;
      const double final_mm = Statistics::of(mm).median;
      const double final_deg = Statistics::of(deg).median;
      const double online_px = Statistics::of(online).median;
      context.summary[mode]["recording"][robot.key] = {{"tip_px", {{"mean", final_px}}},
                                                       {"tip_mm", {{"mean", final_mm}}},
                                                       {"hand_deg", {{"mean", final_deg}}},
                                                       {"last30_px", {{"median_of_seeds", online_px}}},
                                                       {"uncorrected_px", result.uncorrected.px}};
      context.table += fmt::format("{:<38} {:>7.1f} / {:<6.1f} {:>7.2f} / {:<6.2f} {:>9.2f} {:>12.2f}\n",
                                   fmt::format("{}, {}", robot.title, mode), result.uncorrected.px,
                                   result.uncorrected.mm, final_px, final_mm, final_deg, online_px);
    }
  }
}

}  // namespace bodyschema
