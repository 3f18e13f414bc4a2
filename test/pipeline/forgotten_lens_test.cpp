#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>

#include "bodyschema/pipeline/pipeline.hpp"
#include "bodyschema/simulator/scenes.hpp"
#include "bodyschema/simulator/simulator.hpp"

namespace bodyschema {
namespace {

/// What became of a log through lenses of k1 = -0.3 that the configuration does not have.
struct Outcome {
  int converged = 0, wrong = 0;
  double k1 = 0.0, k1_sd = 0.0, hand_mm = 0.0;
  std::string misfit;
};

Outcome through_forgotten_lenses(const std::string& distortion) {
  const auto configuration =
      Configuration::load(std::filesystem::path(BODYSCHEMA_SOURCE_DIR) / "config/icub_right/evaluation.yaml",
                          {"vision.method=single_colour", "silhouette.engine=contour",
                           "cameras.left.distortion=" + distortion, "cameras.right.distortion=" + distortion});
  Pipeline pipeline(configuration);
  auto settings = simulator::SimulatorSettings::from(configuration.section("simulator"));
  settings.camera_rate_hz = 8.0;
  settings.motion.postures = 8;
  settings.entry_frames = settings.background_frames = 0;
  simulator::apply_scene(settings, "lens_forgotten");
  simulator::SimulationPlan plan;
  plan.seed = 21;
  plan.motion = simulator::Motion::kBabble;
  plan.seconds = 15.0;
  plan.offsets_deg = {{"r_shoulder_pitch", 3}, {"r_shoulder_yaw", -4}, {"r_elbow", 2}, {"r_wrist_yaw", 4}};
  simulator::Simulator simulator(pipeline.shared_robot(), pipeline.setup(), pipeline.rig(), settings, plan);
  Outcome outcome;
  std::vector<JointSample> history;
  while (auto frame = simulator.next()) {
    history.insert(history.end(), frame->encoders.begin(), frame->encoders.end());
    Observation observation = simulator::to_observation(*frame, history);
    observation.encoders = frame->encoders;
    const Estimate estimate = pipeline.process(observation);
    for (const auto& effect : estimate.effects) {
      if (effect.effect != "distortion") continue;
      outcome.k1 = effect.value;
      outcome.k1_sd = effect.sd;
    }
    if (!estimate.misfit.empty()) outcome.misfit = estimate.misfit;
    if (estimate.X_CP.empty()) continue;
    outcome.hand_mm = 1e3 * (estimate.X_CP[0].translation() - frame->truth[0].X_CP.translation()).norm();
    if (estimate.state != EstimatorState::kConverged) continue;
    ++outcome.converged;
    outcome.wrong += outcome.hand_mm > 2.0 && outcome.hand_mm > 3e3 * estimate.hand_sd_m;
  }
  std::printf("    distortion %s: k1 %.3f +- %.3f, hand %.2f mm, %d converged, %d wrong%s\n", distortion.c_str(),
              outcome.k1, outcome.k1_sd, outcome.hand_mm, outcome.converged, outcome.wrong,
              outcome.misfit.empty() ? "" : (", misfit: " + outcome.misfit).c_str());
  return outcome;
}

TEST(ForgottenLens, ThatNobodyCalibratedIsFound) {
  const auto outcome = through_forgotten_lenses("unknown");
  EXPECT_EQ(outcome.wrong, 0);
  EXPECT_GT(outcome.converged, 0);
  EXPECT_NEAR(outcome.k1, -0.3, std::max(0.03, 3.0 * outcome.k1_sd));
  EXPECT_LT(outcome.hand_mm, 2.0);
}

TEST(ForgottenLens, ThatIsSaidNotToBendMakesNoConfidentlyWrongHand) {
  const auto outcome = through_forgotten_lenses("[0, 0, 0, 0, 0]");
  EXPECT_EQ(outcome.wrong, 0);
}

}  // namespace
}  // namespace bodyschema
