#include <gtest/gtest.h>

#include "bodyschema/core/error.hpp"
#include "diagnosis/edited_log.hpp"
#include "diagnosis_trials/trial_robot.hpp"

/// The motion of the hand that residuals ask for, where the two eyes of an instant are not what one expects.
namespace bodyschema {
namespace {

using test::EditedLog;

std::unique_ptr<SyntheticMeasurement> late_log() {
  TrialOptions options;
  options.duration_s = 20.0;
  options.faults = {{{"latency", "", ""}, 80.0, 0.0, 0.0}};
  return make_synthetic_log(test::robot(), options, test::log_seed());
}

HeldoutError error_of(MeasurementSource& log) {
  auto options = test::usual_options(log);
  options.fixed_causes.emplace();  // nothing is searched for
  return diagnose(log, options).before;
}

TEST(HandError, DoesNotDependOnTheOrderOfTheEyes) {
  const auto log = late_log();
  const auto usual = error_of(*log);
  std::vector<std::size_t> turned;
  for (std::size_t v = 0; v + 1 < log->views().size(); v += 2) turned.insert(turned.end(), {v + 1, v});
  EditedLog right_first(*log, turned);
  for (std::size_t v = 0; v + 1 < turned.size(); v += 2) {
    auto& views = right_first.views_for_editing();
    std::swap(views[v].joints.utime, views[v + 1].joints.utime);
  }
  const auto other = error_of(right_first);
  EXPECT_GT(usual.hand_mm, 1.0);
  EXPECT_NEAR(other.hand_mm, usual.hand_mm, 0.02 * usual.hand_mm);
  EXPECT_NEAR(other.hand_deg, usual.hand_deg, 0.02 * usual.hand_deg);
}

TEST(HandError, OfOneEyeAloneIsThatOfThisEye) {
  const auto log = late_log();
  std::vector<std::size_t> by_eye[2];
  for (std::size_t v = 0; v < log->views().size(); ++v) by_eye[log->views()[v].camera].push_back(v);
  EditedLog left(*log, by_eye[0]), right(*log, by_eye[1]);
  const auto a = error_of(left), b = error_of(right);
  // The same hand in the same postures.
  EXPECT_NEAR(a.hand_mm, b.hand_mm, 0.3 * a.hand_mm);
  EXPECT_NEAR(a.hand_deg, b.hand_deg, 0.3 * a.hand_deg);
}

TEST(HandError, BarelyChangesWhereOneEyeMissesTheHandNowAndThen) {
  const auto log = late_log();
  const auto usual = error_of(*log);
  for (const std::size_t eye : {0u, 1u}) {
    auto gaps = EditedLog::whole(*log);
    for (std::size_t v = eye; v < log->views().size(); v += 6) gaps.hide(v);  // every third picture of the eye
    const auto other = error_of(gaps);
    EXPECT_NEAR(other.hand_mm, usual.hand_mm, 0.1 * usual.hand_mm) << "eye " << eye;
    EXPECT_NEAR(other.hand_deg, usual.hand_deg, 0.1 * usual.hand_deg) << "eye " << eye;
  }
}

}  // namespace
}  // namespace bodyschema
