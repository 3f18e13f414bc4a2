#include <gtest/gtest.h>

#include <random>

#include "bodyschema/evaluation/trial.hpp"

namespace bodyschema {
namespace {

/// A whole reach of 100 frames through pictures, masks and estimator with one engine.
ContestantRecord reach(const std::string& engine, const std::string& platform, std::size_t particles,
                       std::uint64_t seed, EstimatorMode mode = EstimatorMode::kBest) {
  const std::filesystem::path config =
      std::filesystem::path(BODYSCHEMA_SOURCE_DIR) / "config/icub_right/evaluation.yaml";
  const Configuration configuration =
      Configuration::load(config, {"silhouette.engine=" + engine, "silhouette.gl_platform=" + platform});
  TrialSetting setting{configuration, simulator::SimulatorSettings::from(configuration.section("simulator")), {}, {}};
  setting.simulator.background_frames = 25;
  setting.simulator.entry_frames = 0;
  setting.plan.frames = 100;
  setting.plan.offsets_deg = {{"r_shoulder_pitch", 5}, {"r_shoulder_roll", 4}, {"r_shoulder_yaw", 3}, {"r_elbow", -2},
                              {"r_wrist_prosup", 3},   {"r_wrist_pitch", -7},  {"r_wrist_yaw", 3}};
  Contestant contestant{engine, EstimatorOptions::from(configuration), false};
  contestant.options.mode = mode;
  contestant.options.filter.particles = particles;
  return run_trial(setting, {contestant}, seed).contestants[0];
}

double mean_of_last_ten_mm(const ContestantRecord& record) {
  double sum = 0.0;
  for (std::size_t i = record.frames.size() - 10; i < record.frames.size(); ++i) {
    sum += record.frames[i].position_mm[0];
  }
  return sum / 10.0;
}

TEST(WholeReach, BestModeOnAFreshSeedIsBelowOneMillimetre) {
  const auto seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  RecordProperty("seed", std::to_string(seed));
  const ContestantRecord record = reach("contour", "auto", 200, seed);
  ASSERT_EQ(record.frames.size(), 100u);
  EXPECT_GT(record.frames.back().nominal_mm[0], 10.0);
  EXPECT_LT(mean_of_last_ten_mm(record), 1.0);
}

TEST(WholeReach, PaperModeOnAFixedSeedIsBelowItsBound) {
  EXPECT_LT(mean_of_last_ten_mm(reach("contour", "auto", 200, 2, EstimatorMode::kPaper)), 15.0);
}

// Fewer particles than by default: the picture is drawn in software here.
TEST(WholeReach, AtlasOnEgl) {
  EXPECT_LT(mean_of_last_ten_mm(reach("atlas", "egl_surfaceless", 50, 2)), 1.0);
}

TEST(WholeReach, AtlasOnOsmesa) {
  EXPECT_LT(mean_of_last_ten_mm(reach("atlas", "osmesa", 50, 2)), 1.0);
}

}  // namespace
}  // namespace bodyschema
