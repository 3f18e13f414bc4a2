#include <spdlog/fmt/fmt.h>
#include <unistd.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <random>
#include <sstream>

#include "bodyschema/calibration/calibrate.hpp"
#include "bodyschema/core/progress_bar.hpp"
#include "bodyschema/core/write_file.hpp"
#include "bodyschema/imports/camera_pose_file.hpp"
#include "bodyschema/imports/stills.hpp"
#include "bodyschema/pipeline/starter_configuration.hpp"
#include "bodyschema/robot/forward_kinematics.hpp"
#include "experiments.hpp"

/// Photographs of physical robots, calibrated from pictures and intrinsics alone. What is true is what is hidden in
/// them: offsets added to the recorded joint angles. That the robots' own encoders are right, to a tenth of a degree,
/// is an assumption: the arms are calibrated by their maker. Camera poses that others published are a witness, not
/// truth.
namespace bodyschema {
namespace {

namespace fs = std::filesystem;

constexpr double kInjected_sd_deg = 4.0;
constexpr double kOwnEncoders_deg = 0.1;  ///< how right the robots' own encoders are taken to be

struct Demand {
  const char* set;
  const char* name;
  double rms_deg, repeat_deg;
};
constexpr Demand kSets[] = {{"lbr_zed5", "LBR, 5 postures", 0.4, 0.1}, {"lbr_zed10", "LBR, 10 postures", 0.25, 0.05}};

struct RealTrial {
  std::map<std::string, double> injected_deg;
  Calibration calibration;
};

/// A copy of a folder of stills with offsets added to the joints, pictures by reference.
void copy_with(const fs::path& from, const fs::path& to, const std::map<std::string, double>& offsets_deg) {
  fs::create_directories(to);
  for (const char* folder : {"images", "masks", "camera_info"}) {
    fs::create_directory_symlink(fs::absolute(from / folder), to / folder);
  }
  std::ifstream in(from / "joints.csv");
  std::string line, text;
  std::vector<std::string> names;
  while (std::getline(in, line)) {
    std::stringstream cells(line);
    std::string cell, row;
    for (std::size_t i = 0; std::getline(cells, cell, ','); ++i) {
      if (text.empty()) names.push_back(cell);
      const auto offset = offsets_deg.find(names[i]);
      if (!text.empty() && offset != offsets_deg.end())
        cell = fmt::format("{:.12g}", std::stod(cell) + radians(offset->second));
      row += (i > 0 ? "," : "") + cell;
    }
    text += row + '\n';
  }
  write_file(to / "joints.csv", text);
}

std::map<std::string, double> draw_offsets(const fs::path& set, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0.0, kInjected_sd_deg);
  std::map<std::string, double> offsets;
  for (const auto& name : StillsColumns::read(set).names) offsets[name] = normal(random);
  return offsets;
}

RealTrial run_trial(const fs::path& set, const fs::path& urdf, std::uint64_t seed, const fs::path& work) {
  RealTrial trial;
  trial.injected_deg = draw_offsets(set, seed);
  copy_with(set, work / "stills", trial.injected_deg);
  StarterOptions starter;
  starter.urdf = urdf;
  starter.stills = work / "stills";
  starter.out = work / "robot";
  write_starter_configuration(starter);
  const auto configuration = Configuration::load(work / "robot" / "estimator.yaml");
  import_stills(work / "stills", ImportTarget::from(configuration), {}, work / "log");
  CalibrationOptions options;
  options.log = work / "log";
  options.out = work / "calibration";
  options.quiet = true;
  trial.calibration = calibrate(Configuration::load(work / "robot" / "estimator.yaml"), options);
  return trial;
}

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
  double worst_z = 0.0, camera_mm = 0.0, camera_deg = 0.0, heldout_px = 0.0;
  int n = 0, repeats = 0, good = 0, trials = 0, dishonest = 0;
  std::size_t fewest_told = 1000;
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
    f.heldout_px = std::max(f.heldout_px, c.outline_px.heldout.value_or(0.0));
    std::size_t told = 0;
    for (std::size_t j = 0; j < c.joints.size(); ++j) {
      const auto& joint = c.joints[j];
      if (!joint.told) continue;
      ++told;
      const double error = degrees(joint.offset_rad) - trial.injected_deg.at(joint.name), sd = degrees(joint.sd_rad);
      const double z = std::abs(error) / std::hypot(sd, kOwnEncoders_deg);
      f.worst_z = std::max(f.worst_z, z);
      f.z_square += z * z;
      f.dishonest += good && (std::abs(error) > 5.0 * sd || (std::abs(error) > 3.0 * sd && std::abs(error) > 0.5));
      if (j == 0) continue;  // the first joint and the camera's turn are one
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

}  // namespace

void run_real(ExperimentContext& context) {
  const fs::path data = context.options.data / "real";
  if (!fs::exists(data)) {
    context.table += "\nreal robots: skipped, no recordings in " + data.string() + "\n";
    return;
  }
  const int trials = std::clamp(context.options.trials, 1, 10);
  context.table +=
      fmt::format("\n{:<34} {:>6} {:>7} {:>7} {:>7} {:>6} {:>5} {:>8} {:>8} {:>6}\n", "real robots, camera unknown",
                  "seeds", "rms deg", "repeat", "worst z", "rms z", "told", "cam mm", "cam deg", "good");
  const fs::path urdf = data / "robots" / "lbr_med7" / "lbr_med7.urdf";
  for (const auto& demand : kSets) {
    ProgressBar bar(demand.name, static_cast<std::uint64_t>(trials));
    std::vector<RealTrial> list;
    for (int t = 0; t < trials; ++t) {
      const fs::path work = fs::temp_directory_path() / fmt::format("bodyschema_{}_{}_{}", getpid(), demand.set, t);
      list.push_back(run_trial(data / demand.set, urdf, context.options.seed + static_cast<std::uint64_t>(t), work));
      std::error_code error;
      fs::remove_all(work, error);
      bar.set(static_cast<std::uint64_t>(t + 1));
    }
    RobotModelOptions options;
    options.urdf = urdf;
    const auto robot = RobotModel::load(options);
    const auto f = figures_of(list, CameraPoses::read(data / demand.set / "camera_pose.json", "left_dr"), robot);
    const double n = std::max(1, f.n);
    const double rms = std::sqrt(f.square / n), repeat = std::sqrt(f.repeat_square / std::max(1, f.repeats)),
                 rms_z = std::sqrt(f.z_square / n);
    context.table += fmt::format("{:<34} {:>6} {:>7.3f} {:>7.3f} {:>7.2f} {:>6.2f} {:>5} {:>8.1f} {:>8.2f} {:>3}/{}\n",
                                 demand.name, f.trials, rms, repeat, f.worst_z, rms_z, f.fewest_told, f.camera_mm,
                                 f.camera_deg, f.good, f.trials);
    for (std::size_t t = 0; t < list.size(); ++t) {
      if (list[t].calibration.state == CalibrationState::kGood) continue;
      context.table += fmt::format("  seed {}: {}\n", context.options.seed + t, list[t].calibration.sentence);
    }
    context.table += fmt::format("{:<34} {:>6} {:>7.3f} {:>7.3f} {:>7.2f} {:>6} {:>5} {:>8.1f} {:>8.2f}\n",
                                 "  demanded", "", demand.rms_deg, demand.repeat_deg, 2.5, "", 4, 15.0, 0.7);
    context.summary["real"][demand.set] = {{"trials", f.trials},
                                           {"rms_deg", rms},
                                           {"repeat_deg", repeat},
                                           {"worst_z", f.worst_z},
                                           {"rms_z", rms_z},
                                           {"told", f.fewest_told},
                                           {"camera_mm", f.camera_mm},
                                           {"camera_deg", f.camera_deg},
                                           {"heldout_px", f.heldout_px},
                                           {"good", f.good},
                                           {"dishonest", f.dishonest}};
  }
}

}  // namespace bodyschema
