#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "bodyschema/core/configuration.hpp"
#include "bodyschema/diagnosis/diagnoser.hpp"
#include "bodyschema/estimator/estimator_options.hpp"
#include "bodyschema/evidence/log_fit.hpp"
#include "bodyschema/simulator/simulator.hpp"

namespace bodyschema::test {

/// What is simulated for a log: our own robot that babbles, seen by masks with an outline noise of 0.3 px, and what is
/// wrong with it.
struct Simulated {
  std::uint64_t seed = 1;
  double seconds = 35.0, rate_hz = 5.0;
  std::vector<std::string> faults{};
  std::vector<std::string> frozen{};
  bool head_moves = false;
  std::vector<Belief> state{};  ///< what is estimated besides
  std::map<std::string, double> offsets_deg = {{"r_shoulder_pitch", 3.0}, {"r_elbow", -4.0}, {"r_wrist_yaw", 5.0}};
};

/// A log of exact masks with noise along their outlines, without pictures, files and segmentation: what a diagnosis
/// works on. The simulator's physics make the faults and know nothing of the effects that are fitted.
class SimulatedLog {
 public:
  explicit SimulatedLog(const Simulated& what)
      : configuration_(
            Configuration::load(std::filesystem::path(BODYSCHEMA_SOURCE_DIR) / "config/icub_right/evaluation.yaml")),
        setup_(RobotSetup::from(configuration_.section("robot"))),
        rig_(StereoRig::from(configuration_.section("cameras"))), robot_(load_robot(setup_, rig_)),
        pictures_(robot_, setup_, rig_), fit_(pictures_, 1), options_(EstimatorOptions::from(configuration_)),
        beliefs_(Beliefs::from(configuration_, pictures_.roles(), rig_, options_)) {
    beliefs_.state.insert(beliefs_.state.end(), what.state.begin(), what.state.end());
    auto settings = simulator::SimulatorSettings::from(configuration_.section("simulator"));
    settings.camera_rate_hz = what.rate_hz;
    settings.supersampling = 2;
    settings.outline_noise.sd_px = 0.3;
    settings.background_frames = settings.entry_frames = 0;
    settings.head_moves = what.head_moves;
    simulator::SimulationPlan plan;
    plan.seed = what.seed;
    plan.motion = simulator::Motion::kBabble;
    plan.seconds = what.seconds;
    plan.offsets_deg = what.offsets_deg;
    plan.frozen_joints = what.frozen;
    plan.output = simulator::Output::kSilhouettes;
    for (const auto& fault : what.faults) plan.faults.push_back(simulator::FaultSpec::parse(fault));
    simulator::Simulator simulator(robot_, setup_, rig_, settings, plan);
    std::vector<JointSample> encoders;
    while (const auto frame = simulator.next()) {
      encoders.insert(encoders.end(), frame->encoders.begin(), frame->encoders.end());
      pictures_.add(simulator::to_observation(*frame, encoders));
    }
    pictures_.set_encoders(std::move(encoders));
    pictures_.finish();
  }

  [[nodiscard]] LogFit& fit() { return fit_; }
  [[nodiscard]] const PictureLog& pictures() const { return pictures_; }
  [[nodiscard]] const JointRoles& roles() const { return pictures_.roles(); }
  [[nodiscard]] const Beliefs& beliefs() const { return beliefs_; }
  [[nodiscard]] DiagnosisReport diagnosis(const DiagnosisOptions& options = {}) {
    return diagnose(fit_, beliefs_.state, beliefs_.tolerances, options);
  }

 private:
  Configuration configuration_;
  RobotSetup setup_;
  StereoRig rig_;
  std::shared_ptr<const RobotModel> robot_;
  PictureLog pictures_;
  LogFit fit_;
  EstimatorOptions options_;
  Beliefs beliefs_;
};

}  // namespace bodyschema::test
