#pragma once

#include <gtest/gtest.h>

#include <memory>

#include "bodyschema/core/configuration.hpp"
#include "bodyschema/simulator/simulator.hpp"

namespace bodyschema::simulator {

/// The project's own robot as config/icub_right/simulator.yaml has it, loaded once per program.
struct Stage {
  RobotSetup setup;
  StereoRig rig;
  SimulatorSettings settings;
  std::shared_ptr<const RobotModel> model;

  [[nodiscard]] Eigen::Index joint(const std::string& name) const { return model->joint_index(name); }
  [[nodiscard]] Simulator simulator(const SimulationPlan& plan) const {
    return Simulator(model, setup, rig, settings, plan);
  }
};

inline const Stage& icub_right() {
  static const Stage stage = [] {
    Stage s;
    const auto configuration =
        Configuration::load(std::string(BODYSCHEMA_SOURCE_DIR) + "/config/icub_right/simulator.yaml");
    s.setup = RobotSetup::from(configuration.section("robot"));
    s.rig = StereoRig::from(configuration.section("cameras"));
    s.settings = SimulatorSettings::from(configuration.section("simulator"));
    s.settings.background_frames = 0;
    s.settings.entry_frames = 0;
    s.model = s.setup.load();
    return s;
  }();
  return stage;
}

/// A short reach without pictures: quick, and enough for joints and poses.
inline SimulationPlan joints_only(std::uint64_t seed = 1) {
  SimulationPlan plan;
  plan.seed = seed;
  plan.frames = 30;
  plan.output = Output::kJoints;
  return plan;
}

inline std::vector<SimulatedFrame> run(Simulator simulator) {
  std::vector<SimulatedFrame> frames;
  while (auto frame = simulator.next()) frames.push_back(std::move(*frame));
  return frames;
}

}  // namespace bodyschema::simulator
