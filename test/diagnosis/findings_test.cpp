#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "diagnosis/edited_log.hpp"
#include "diagnosis_trials/trial_robot.hpp"

/// What a whole diagnosis writes into its report.
namespace bodyschema {
namespace {

using test::EditedLog;
using testing::HasSubstr;

std::unique_ptr<SyntheticMeasurement> log_with(const TrialFault& fault, double duration_s = 20.0) {
  TrialOptions options;
  options.duration_s = duration_s;
  options.faults = {fault};
  return make_synthetic_log(test::robot(), options, test::log_seed());
}

/// "deg/log" says nothing without the span.
TEST(Findings, ADriftHasItsSpan) {
  const CauseName drift{"drift", "r_elbow", ""};
  const auto log = log_with({drift, 3.0, 0.0, 0.0});
  auto late = EditedLog::whole(*log);
  constexpr std::size_t kEmptyRoom = 20, kGone = 10;
  const auto views = late.views();
  for (std::size_t v = 0; v < kEmptyRoom; ++v) late.hide(v);
  for (std::size_t v = views.size() - kGone; v < views.size(); ++v) late.hide(v);
  auto options = test::usual_options(late);
  options.fixed_causes = {{drift}};
  const auto report = diagnose(late, options);
  ASSERT_EQ(report.causes.size(), 1u);
  const auto& change = report.causes[0].parameters.at(0);
  const auto begin = views[kEmptyRoom].joints.utime, end = views[views.size() - kGone - 1].joints.utime;
  ASSERT_TRUE(change.from && change.duration_s);
  EXPECT_NEAR(static_cast<double>(*change.from), static_cast<double>(begin), 2.0);
  EXPECT_NEAR(*change.duration_s, seconds(end - begin), 1e-5);
  EXPECT_THAT(report.to_json(), HasSubstr("\"duration_s\": " + std::to_string(*change.duration_s).substr(0, 4)));
}

/// Pictures that repeat the last ones are left out, and a rest without noise is one picture.
TEST(Findings, ARestOfRepeatedPicturesIsNotCalledMissing) {
  const auto log = log_with({{"latency", "", ""}, 40.0, 0.0, 0.0}, 60.0);
  std::vector<std::size_t> moving;
  Eigen::VectorXd last[2];
  for (std::size_t v = 0; v < log->views().size(); ++v) {
    const auto& view = log->views()[v];
    auto& q = last[view.camera];
    if (q.size() > 0 && (view.joints.q - q).cwiseAbs().maxCoeff() < 0.5 * kPi / 180.0) continue;
    q = view.joints.q;
    moving.push_back(v);
  }
  EditedLog without(*log, moving);
  auto options = test::usual_options(without);
  options.fixed_causes.emplace();
  const auto report = diagnose(without, options);
  ASSERT_FALSE(report.warnings.empty());
  EXPECT_THAT(report.warnings[0], HasSubstr("correlation time is not measured"));
  EXPECT_THAT(report.warnings[0], HasSubstr("repeats of the picture before do not count"));
}

/// One camera tells nothing of the angle between two: it is neither tested nor may it run off unseen.
TEST(Findings, OfOneCameraTheModelHoldsNothingBetweenTwo) {
  const auto log = log_with({{"latency", "", ""}, 60.0, 0.0, 0.0});
  std::vector<std::size_t> left;
  for (std::size_t v = 0; v < log->views().size(); ++v) {
    if (log->views()[v].camera == 0) left.push_back(v);
  }
  EditedLog one(*log, left);
  auto options = test::usual_options(one);
  options.fixed_causes = {{{"latency", "", ""}}};
  auto report = diagnose(one, options);
  for (auto* model : {&*report.extended_model, &*report.baseline_model}) {
    EXPECT_EQ(model->find("vergence", {}), nullptr);
    EXPECT_NE(model->find("focal_length", {}), nullptr);
  }
}

/// A free curve takes its share of the loss in `after` as the gain beside it says.
TEST(Findings, ASizeThatNoRobotHasIsNoExplanation) {
  for (const double percent : {15.0, 25.0}) {
    const auto log = log_with({{"encoder_gain", "r_elbow", ""}, percent, 0.0, 0.0}, 60.0);
    const auto report = diagnose(*log, test::usual_options(*log));
    ASSERT_EQ(report.causes.size(), 1u) << report.sentence;
    EXPECT_NEAR(report.causes[0].parameters[0].estimate, percent, 2.0) << report.sentence;
    EXPECT_EQ(report.causes[0].implausible, percent > 20.0);
    EXPECT_EQ(report.verdict == "unexplained", percent > 20.0) << report.sentence;
  }
}

TEST(Findings, AnUnexplainedCauseTakesItsShareOfTheHeldOutLoss) {
  const auto log = log_with({{"wobble", "r_elbow", ""}, 1.5, 8.0, 0.0}, 60.0);
  const auto report = diagnose(*log, test::usual_options(*log));
  ASSERT_EQ(report.causes.size(), 1u) << report.sentence;
  ASSERT_EQ(report.causes[0].cause, (CauseName{"unexplained", "r_elbow", ""})) << report.sentence;
  ASSERT_GT(report.causes[0].heldout_gain, 0.2);
  const double taken = 1.0 - std::pow(report.after.rms_px / report.before.rms_px, 2);
  EXPECT_NEAR(taken, report.causes[0].heldout_gain, 0.25 * report.causes[0].heldout_gain);
  EXPECT_LT(report.after.hand_mm, report.before.hand_mm);
  // The charts show the wobble, which no model holds; what errs alike is measured without it.
  double shown = 0.0, noise = 0.0;
  for (const auto& sample : report.samples) {
    shown += std::pow(sample.after.rms_px, 2);
    noise += std::pow(sample.noise.rms_px, 2);
  }
  EXPECT_NEAR(1.0 - noise / shown, report.causes[0].heldout_gain, 0.25 * report.causes[0].heldout_gain);
}

}  // namespace
}  // namespace bodyschema
