#include <spdlog/fmt/fmt.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <random>

#include "bodyschema/core/error.hpp"
#include "bodyschema/core/progress_bar.hpp"
#include "bodyschema/evidence/outline_distance.hpp"
#include "bodyschema/imports/camera_pose_file.hpp"
#include "bodyschema/imports/stills.hpp"
#include "bodyschema/pipeline/watched_log.hpp"
#include "bodyschema/robot/forward_kinematics.hpp"
#include "checkerboard.hpp"
#include "depth_witness.hpp"
#include "experiments.hpp"
#include "outline_figure.hpp"
#include "real_trial.hpp"
#include "in_parallel.hpp"
#include "scratch.hpp"

/// Photographs of physical robots, calibrated from pictures and intrinsics alone.
///
/// Truth is what is hidden in them: offsets added to the recorded joint angles. That the robots' own encoders are
/// right, to a tenth of a degree, is an assumption: the arms are calibrated by their maker. Witnesses, not truth, are
/// the camera poses that others published, a depth camera, and a board in the hand: all have errors of their own.
namespace bodyschema {
namespace {

namespace fs = std::filesystem;

constexpr double kInjected_sd_deg = 4.0;
constexpr double kOwnEncoders_deg = 0.1;  ///< how right the robots' own encoders are taken to be
constexpr int kMostTrials = 10;
constexpr int kTrialsAmongAll = 2;  ///< where everything is evaluated, which takes long

struct Demand {
  const char* set;
  const char* name;
  double rms_deg, repeat_deg;
  double raw_deg;      ///< rms, from pictures without masks
  std::size_t subset;  ///< postures of a subset
};
constexpr Demand kSets[] = {{"lbr_zed5", "LBR, 5 postures", 0.4, 0.1, 0.6, 4},
                            {"lbr_zed10", "LBR, 10 postures", 0.25, 0.05, 0.4, 7}};
constexpr const char* kBoard = "panda_1";
constexpr const char* kHumanoid = "g1";
/// How far off the camera is where it is said to be known roughly.
constexpr double kRough_deg = 5.0, kRough_m = 0.05;

struct PoseDifference {
  double mm = 0.0, deg = 0.0;
};

/// Between two poses of a camera in the base, the turn about the first joint's axis that brings them closest taken out:
/// no picture tells it from that joint's offset.
PoseDifference difference(const Pose& found, const Pose& published, const std::shared_ptr<const RobotModel>& robot,
                          const std::string& first_joint) {
  const auto joint = robot->joint_index(first_joint);
  ForwardKinematics kinematics(robot, {robot->joints()[static_cast<std::size_t>(joint)].child_link});
  std::vector<Pose> X_0(1), X_1(1);
  Eigen::VectorXd q = Eigen::VectorXd::Zero(robot->joint_count());
  kinematics.compute(q, X_0);
  PoseDifference best{1e9, 1e9};
  double least = 1e18;
  for (double turn_deg = -40.0; turn_deg <= 40.0; turn_deg += 0.01) {
    q[joint] = radians(turn_deg);
    kinematics.compute(q, X_1);
    const Pose X = X_1.front() * X_0.front().inverse(Eigen::Isometry) * found;
    const double mm = 1e3 * (X.translation() - published.translation()).norm();
    const double deg = degrees(Eigen::AngleAxisd(Eigen::Matrix3d(X.linear().transpose() * published.linear())).angle());
    const double cost = std::pow(mm / 15.0, 2) + std::pow(deg / 0.7, 2);
    if (cost >= least) continue;
    least = cost;
    best = {mm, deg};
  }
  return best;
}

struct SetFigures {
  double square = 0.0, repeat_square = 0.0, z_square = 0.0;
  double worst_z = 0.0, camera_mm = 0.0, camera_deg = 0.0, before_px = 0.0, after_px = 0.0;
  std::optional<double> heldout_px;  ///< of the trials that have enough postures to leave some out
  double first_joint_sd_deg = 0.0;
  int n = 0, repeats = 0, good = 0, trials = 0, dishonest = 0;
  std::size_t fewest_told = 1000;

  [[nodiscard]] double rms_deg() const { return std::sqrt(square / std::max(1, n)); }
  [[nodiscard]] double repeat_deg() const { return std::sqrt(repeat_square / std::max(1, repeats)); }
  [[nodiscard]] double rms_z() const { return std::sqrt(z_square / std::max(1, n)); }
};

SetFigures figures_of(const std::vector<RealTrial>& trials, const CameraPoses& published,
                      const std::shared_ptr<const RobotModel>& robot) {
  SetFigures f;
  std::map<std::string, std::vector<double>> errors;
  for (const auto& trial : trials) {
    const auto& c = trial.calibration;
    const bool good = c.state == CalibrationState::kGood;
    f.good += good;
    ++f.trials;
    f.before_px = std::max(f.before_px, c.outline_px.before);
    f.after_px = std::max(f.after_px, c.outline_px.after);
    if (const auto& heldout = c.outline_px.heldout) f.heldout_px = std::max(f.heldout_px.value_or(*heldout), *heldout);
    std::size_t told = 0;
    for (std::size_t j = 0; j < c.joints.size(); ++j) {
      const auto& joint = c.joints[j];
      const double error = degrees(joint.offset_rad) - trial.hidden.offsets_deg.at(joint.name);
      const double sd = degrees(joint.sd_rad);
      if (j == 0) f.first_joint_sd_deg = std::max(f.first_joint_sd_deg, sd);
      if (!joint.told) continue;
      ++told;
      const double z = std::abs(error) / std::hypot(sd, kOwnEncoders_deg);
      f.worst_z = std::max(f.worst_z, z);
      f.dishonest += good && (std::abs(error) > 5.0 * sd || (std::abs(error) > 3.0 * sd && std::abs(error) > 0.5));
      if (j == 0) continue;  // the first joint and the camera's turn are one
      f.z_square += z * z;
      f.square += error * error;
      ++f.n;
      errors[joint.name].push_back(error);
    }
    f.fewest_told = std::min(f.fewest_told, told);
    const auto apart = difference(c.cameras.front().X_link_optical, published.X_base_optical.at(c.cameras.front().name),
                                  robot, c.joints.front().name);
    f.camera_mm = std::max(f.camera_mm, apart.mm);
    f.camera_deg = std::max(f.camera_deg, apart.deg);
  }
  for (const auto& [name, list] : errors) {
    for (std::size_t i = 1; i < list.size(); ++i) {
      f.repeat_square += std::pow(list[i] - list[i - 1], 2);
      ++f.repeats;
    }
  }
  return f;
}

Json figures_json(const SetFigures& f) {
  Json json = {{"trials", f.trials},
               {"rms_deg", f.rms_deg()},
               {"repeat_deg", f.repeat_deg()},
               {"worst_z", f.worst_z},
               {"rms_z", f.rms_z()},
               {"told", f.fewest_told},
               {"first_joint_sd_deg", f.first_joint_sd_deg},
               {"camera_mm", f.camera_mm},
               {"camera_deg", f.camera_deg},
               {"before_px", f.before_px},
               {"after_px", f.after_px},
               {"good", f.good},
               {"dishonest", f.dishonest}};
  if (f.heldout_px) json["heldout_px"] = *f.heldout_px;
  return json;
}

class RealExperiment {
 public:
  explicit RealExperiment(ExperimentContext& context)
      : context_(context), data_(context.options.data / "real"), lbr_(data_ / "robots" / "lbr_med7" / "lbr_med7.urdf"),
        trials_(std::clamp(context.options.trials, 1,
                           context.options.experiment == "all" ? kTrialsAmongAll : kMostTrials)) {}

  void run() {
    if (!fs::exists(data_)) {
      context_.table += "\nreal robots: skipped, no recordings in " + data_.string() + "\n";
      return;
    }
    context_.table +=
        fmt::format("\n{:<34} {:>6} {:>7} {:>7} {:>7} {:>6} {:>5} {:>8} {:>8} {:>6}\n", "real robots, camera unknown",
                    "seeds", "rms deg", "repeat", "worst z", "rms z", "told", "cam mm", "cam deg", "good");
    each_set([&](const Demand& demand) { offsets_found(demand); });
    context_.table +=
        "truth: offsets hidden in the encoders; the robots' own are taken to be right to 0.1 deg. witness: the "
        "published pose\nleft_dr, the turn about the first joint's axis taken out. rms z without the first joint.\n";
    context_.table +=
        fmt::format("\n{:<34} {:>6} {:>7} {:>7} {:>7} {:>6} {:>5} {:>8} {:>8} {:>6}\n", "pictures without masks",
                    "seeds", "rms deg", "repeat", "worst z", "rms z", "told", "cam mm", "cam deg", "good");
    each_set([&](const Demand& demand) { offsets_found_without_masks(demand); });
    context_.table += fmt::format("\n{:<34} {:>10} {:>10} {:>10}\n", "the same pictures, by others' poses",
                                  "outline px", "left out", "depth mm");
    each_set([&](const Demand& demand) { others(demand); });
    context_.table +=
        "witness: masks and depth; medians. Others' poses with the encoders as they are; ours with offsets hidden, "
        "before and after.\n";
    if (is_asked_for(context_.options, kBoard)) board();
    if (is_asked_for(context_.options, kHumanoid)) run_humanoid(context_);
  }

 private:
  void each_set(const std::function<void(const Demand&)>& visit) const {
    for (const auto& demand : kSets) {
      if (is_asked_for(context_.options, demand.set)) visit(demand);
    }
  }

  RealTrial trial(const Demand& demand, std::uint64_t seed, std::vector<std::int64_t> postures, bool masks = true,
                  std::vector<std::string> overrides = {}) {
    RealTrialOptions options{
        .set = data_ / demand.set, .urdf = lbr_, .masks = masks, .overrides = std::move(overrides)};
    options.hidden.offsets_deg = draw_offsets(options.set, seed, kInjected_sd_deg);
    options.hidden.postures = std::move(postures);
    const Scratch work(demand.set);
    return run_real_trial(options, work.path());
  }

  // --- truth: hidden offsets --------------------------------------------------------------------

  void offsets_found(const Demand& demand) {
    const auto postures = JointTable::read(data_ / demand.set).rows.size();
    ProgressBar bar(demand.name, static_cast<std::uint64_t>(2 * trials_));
    std::vector<RealTrial> whole, parts;
    std::mt19937_64 random(context_.options.seed);
    for (int t = 0; t < trials_; ++t) {
      const auto seed = context_.options.seed + static_cast<std::uint64_t>(t);
      whole.push_back(trial(demand, seed, {}));
      bar.set(static_cast<std::uint64_t>(2 * t + 1));
      std::vector<std::int64_t> all(postures);
      for (std::size_t i = 0; i < postures; ++i) all[i] = static_cast<std::int64_t>(i);
      std::shuffle(all.begin(), all.end(), random);
      all.resize(demand.subset);
      parts.push_back(trial(demand, seed + 1000, all));
      bar.set(static_cast<std::uint64_t>(2 * t + 2));
    }
    const auto published = CameraPoses::read(data_ / demand.set / "camera_pose.json", "left_dr");
    row(demand.name, figures_of(whole, published, robot()), demand.set);
    not_good(whole);
    context_.table += fmt::format("{:<34} {:>6} {:>7.3f} {:>7.3f} {:>7.2f} {:>6} {:>5} {:>8.1f} {:>8.2f}\n",
                                  "  demanded", "", demand.rms_deg, demand.repeat_deg, 2.5, "", 4, 15.0, 0.7);
    row(fmt::format("  {} of them, other offsets", demand.subset), figures_of(parts, published, robot()),
        std::string(demand.set) + "_subsets");
    not_good(parts);
    ours_[demand.set] = whole.front();
  }

  /// The same from the pictures alone, the first camera known to some degrees and centimetres, or not at all.
  void offsets_found_without_masks(const Demand& demand) {
    const auto published = CameraPoses::read(data_ / demand.set / "camera_pose.json", "left_dr");
    ProgressBar bar(demand.name, static_cast<std::uint64_t>(2 * trials_));
    std::vector<RealTrial> roughly, unknown;
    for (int t = 0; t < trials_; ++t) {
      const auto seed = context_.options.seed + static_cast<std::uint64_t>(t);
      roughly.push_back(trial(demand, seed, {}, false, rough_place(published.X_base_optical.at("left"), seed)));
      bar.set(static_cast<std::uint64_t>(2 * t + 1));
      unknown.push_back(trial(demand, seed + 2000, {}, false));
      bar.set(static_cast<std::uint64_t>(2 * t + 2));
    }
    row(std::string(demand.name) + ", camera to 5 deg, 5 cm", figures_of(roughly, published, robot()),
        std::string(demand.set) + "_raw");
    not_good(roughly);
    context_.table += fmt::format("{:<34} {:>6} {:>7.3f}\n", "  demanded", "", demand.raw_deg);
    row("  camera unknown, other offsets", figures_of(unknown, published, robot()),
        std::string(demand.set) + "_raw_unknown");
    not_good(unknown);
  }

  /// The first camera off by kRough_deg and kRough_m, in some direction, and said to be known as badly.
  [[nodiscard]] std::vector<std::string> rough_place(Pose X_WC, std::uint64_t seed) const {
    std::mt19937_64 random(seed + 7);
    std::normal_distribution<double> normal;
    const auto direction = [&] {
      Eigen::Vector3d d;
      for (double& x : d) x = normal(random);
      return d.normalized();
    };
    X_WC.linear() = X_WC.linear() * Eigen::AngleAxisd(radians(kRough_deg), direction()).toRotationMatrix();
    X_WC.translation() += kRough_m * direction();
    return {"cameras.left.pose=roughly", fmt::format("cameras.left.pose_sd_deg={}", kRough_deg),
            fmt::format("cameras.left.pose_sd_mm={}", 1e3 * kRough_m),
            "cameras.left.X_link_optical=" + pose_yaml(X_WC)};
  }

  void row(const std::string& name, const SetFigures& f, const std::string& key) {
    context_.table += fmt::format("{:<34} {:>6} {:>7.3f} {:>7.3f} {:>7.2f} {:>6.2f} {:>5} {:>8.1f} {:>8.2f} {:>3}/{}\n",
                                  name, f.trials, f.rms_deg(), f.repeat_deg(), f.worst_z, f.rms_z(), f.fewest_told,
                                  f.camera_mm, f.camera_deg, f.good, f.trials);
    context_.summary["real"][key] = figures_json(f);
  }

  void not_good(const std::vector<RealTrial>& trials) {
    for (std::size_t t = 0; t < trials.size(); ++t) {
      if (trials[t].calibration.state == CalibrationState::kGood) continue;
      context_.table += fmt::format("  seed {}: {}\n", context_.options.seed + t, trials[t].calibration.sentence);
    }
  }

  [[nodiscard]] std::shared_ptr<const RobotModel> robot() const {
    RobotModelOptions options;
    options.urdf = lbr_;
    return RobotModel::load(options);
  }

  // --- witnesses: outlines and depth ------------------------------------------------------------

  void others(const Demand& demand) {
    const fs::path set = data_ / demand.set;
    std::ifstream in(set / "camera_pose.json");
    const auto poses = nlohmann::json::parse(in).at("X_base_optical");
    for (const auto& [method, cameras] : poses.items()) {
      const Scratch work(demand.set);
      StarterOptions starter;
      starter.urdf = lbr_;
      starter.stills = set;
      starter.camera_pose = fmt::format("{}:{}", (set / "camera_pose.json").string(), method);
      starter.out = work.path() / "robot";
      write_starter_configuration(starter);
      const auto configuration = Configuration::load(starter.out / "estimator.yaml");
      import_stills(set, ImportTarget::from(configuration), {}, work.path() / "log");
      Pipeline pipeline(configuration);
      WatchedLog watched =
          watch_log(pipeline, {.log = work.path() / "log", .picture_rate_hz = 5.0, .kept = 0, .quiet = true}, false);
      LogFit fit(watched.pictures, thread_count(0));
      const double px = median_outline_distance_px(fit, ErrorModel(watched.pictures.roles()));
      const auto published = CameraPoses::read(set / "camera_pose.json", method);
      const auto mm = depth_mm(demand, pipeline, published.X_base_optical.begin()->second, {}, {});
      context_.table += fmt::format("{:<34} {:>10.2f} {:>10} {:>10}\n", fmt::format("{}, {}", demand.name, method), px,
                                    "", mm ? fmt::format("{:.1f}", *mm) : "");
      auto& entry = context_.summary["real"]["others"][demand.set][method];
      entry["outline_px"] = px;
      if (mm) entry["depth_mm"] = *mm;
      if (method == "left_dr") our_row(demand, pipeline);
    }
  }

  void our_row(const Demand& demand, const Pipeline& pipeline) {
    const auto& trial = ours_.at(demand.set);
    const auto& c = trial.calibration;
    std::map<std::string, double> found_deg;
    for (const auto& joint : c.joints) found_deg[joint.name] = degrees(joint.offset_rad);
    figure(demand, pipeline, found_deg);
    const auto& camera = c.cameras.front().X_link_optical;
    const auto& heldout = c.outline_px.heldout;
    const auto before = depth_mm(demand, pipeline, camera, trial.hidden.offsets_deg, {});
    const auto after = depth_mm(demand, pipeline, camera, trial.hidden.offsets_deg, found_deg);
    context_.table += fmt::format("{:<34} {:>10} {:>10} {:>10}\n", fmt::format("{}, this calibration", demand.name),
                                  fmt::format("{:.2f} {:.2f}", c.outline_px.before, c.outline_px.after),
                                  heldout ? fmt::format("{:.2f}", *heldout) : "-",
                                  after ? fmt::format("{:.1f} {:.1f}", *before, *after) : "");
    auto& entry = context_.summary["real"]["others"][demand.set]["this calibration"];
    entry = {{"outline_before_px", c.outline_px.before}, {"outline_px", c.outline_px.after}};
    if (heldout) entry["outline_heldout_px"] = *heldout;
    if (after) entry["depth_before_mm"] = *before, entry["depth_mm"] = *after;
  }

  /// Of the first camera, where a depth camera took part.
  [[nodiscard]] std::optional<double> depth_mm(const Demand& demand, const Pipeline& pipeline,
                                               const Pose& X_root_optical,
                                               const std::map<std::string, double>& hidden_deg,
                                               const std::map<std::string, double>& found_deg) const {
    const fs::path set = data_ / demand.set;
    const auto& camera = pipeline.rig().cameras.front();
    if (!fs::exists(set / "depth" / camera.name)) return std::nullopt;
    const auto table = JointTable::read(set);
    std::vector<DepthView> views;
    for (std::size_t i = 0; i < table.rows.size(); ++i) {
      const auto file = fmt::format("{:02d}.png", static_cast<int>(table.rows[i].front()));
      views.push_back({set / "depth" / camera.name / file, set / "masks" / camera.name / file,
                       joints_of(pipeline, table.row(i), hidden_deg, found_deg)});
    }
    return median_depth_distance_mm(pipeline, camera.intrinsics, X_root_optical, views);
  }

  /// Joint angles of one row with what was hidden in them, and what was found taken out.
  static Eigen::VectorXd joints_of(const Pipeline& pipeline, const std::map<std::string, double>& row,
                                   const std::map<std::string, double>& hidden_deg,
                                   const std::map<std::string, double>& found_deg) {
    Eigen::VectorXd q = pipeline.setup().default_joints(pipeline.robot());
    for (const auto& [joint, angle] : row) {
      const auto amount = [&](const auto& map) { return map.contains(joint) ? map.at(joint) : 0.0; };
      q[pipeline.robot().joint_index(joint)] = angle + radians(amount(hidden_deg) - amount(found_deg));
    }
    return q;
  }

  /// Outlines of one posture: no photograph.
  void figure(const Demand& demand, const Pipeline& pipeline, const std::map<std::string, double>& found_deg) {
    const auto& trial = ours_.at(demand.set);
    const auto& camera = pipeline.rig().cameras.front();
    const auto row = JointTable::read(data_ / demand.set).row(1);
    const fs::path png = context_.options.out / fmt::format("{}_outlines.png", demand.set);
    write_outline_figure(
        pipeline, camera.intrinsics,
        {data_ / demand.set / "masks" / camera.name / "01.png", joints_of(pipeline, row, trial.hidden.offsets_deg, {}),
         joints_of(pipeline, row, trial.hidden.offsets_deg, found_deg),
         trial.calibration.cameras.front().X_link_optical},
        png);
  }

  // --- witness: a board in the hand ---------------------------------------------------------------

  void board() {
    const fs::path set = data_ / "panda_1";
    const auto corners = read_checkerboard(set / "checkerboard.csv");
    RealTrialOptions options{.set = set, .urdf = data_ / "robots" / "panda" / "panda.urdf", .masks = false};
    const Scratch work("panda_1");
    const auto trial = run_real_trial(options, work.path());
    const auto& c = trial.calibration;
    const auto table = JointTable::read(set);
    std::vector<BoardView> views;
    for (const auto& view : c.views) {
      // Pictures carry the stamps of their rows.
      for (const auto& row : table.rows) {
        if (std::abs(row[1] - seconds(view.utime)) > 1e-3) continue;
        const auto seen = corners.find(static_cast<std::int64_t>(row[0]));
        if (seen != corners.end()) views.push_back({view.X_camera_hand, &seen->second});
      }
    }
    const auto witness = board_witness(views, c.cameras.front().intrinsics, c.cameras.front().distortion);
    double lag_ms = 0.0, lag_sd_ms = 0.0;
    for (const auto& p : c.parameters) {
      if (p.name != "latency") continue;
      lag_ms = p.value;
      lag_sd_ms = p.sd;
    }
    context_.table += fmt::format("\n{:<34} {:>8} {:>9} {:>9} {:>10} {:>14} {:>12}\n", "Panda, mono, no masks",
                                  "pictures", "board px", "board mm", "board deg", "lag ms", "");
    context_.table += fmt::format("{:<34} {:>8} {:>9.2f} {:>9.1f} {:>10.2f} {:>8.0f} +- {:<3.0f} {:>12}\n",
                                  "  camera unknown, outlines alone", witness.pictures, witness.rms_px,
                                  witness.scatter_mm, witness.scatter_deg, lag_ms, lag_sd_ms, to_string(c.state));
    context_.table += fmt::format("{:<34} {:>8} {:>9.2f} {:>9.1f}\n", "  demanded", "", 1.2, 6.0);
    context_.table += fmt::format(
        "  {}\nwitness: one rigid board in the hand, never fitted to; it can refute, not confirm.\n", c.sentence);
    context_.summary["real"]["panda_1"] = {{"pictures", witness.pictures},   {"board_px", witness.rms_px},
                                           {"board_mm", witness.scatter_mm}, {"board_deg", witness.scatter_deg},
                                           {"square_mm", witness.square_mm}, {"lag_ms", lag_ms},
                                           {"lag_sd_ms", lag_sd_ms},         {"state", to_string(c.state)}};
  }

  ExperimentContext& context_;
  fs::path data_, lbr_;
  int trials_;
  std::map<std::string, RealTrial> ours_;
};

}  // namespace

void run_real(ExperimentContext& context) {
  std::vector<std::string> names = {kBoard, kHumanoid};
  for (const auto& demand : kSets) names.emplace_back(demand.set);
  check_rows(context.options, names);
  RealExperiment(context).run();
}

}  // namespace bodyschema
