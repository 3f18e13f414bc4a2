#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "answers.hpp"
#include "picture_log.hpp"

namespace bodyschema {
namespace {

using test::expect_size;
using Settings = simulator::SimulatorSettings;
using Plan = simulator::SimulationPlan;

/// `statistics` looks for the robot near where it is predicted. The prediction was that of the log's first seconds:
/// where the arm had slipped since, it was cut off.
TEST(LongLogDiagnosis, FollowsASlipWhereMasksNeedAPrediction) {
  const test::RenderedLog log([](Settings& settings, Plan& plan) {
    settings.clutter = settings.head_moves = true;
    plan.faults = {simulator::FaultSpec::parse("slip:joint=r_shoulder_pitch,value=4,at=12")};
  });
  const auto report = log.diagnosis("statistics");
  ASSERT_FALSE(report.causes.empty()) << report.sentence;
  expect_size(report, {"slip", "r_shoulder_pitch", ""}, "step", 4.0);
  EXPECT_GT(report.after.outline_found, 0.8);
}

TEST(LongLogDiagnosis, NamesASlipThatCarriesTheOutlinesOutOfSight) {
  const test::RenderedLog log([](Settings& settings, Plan& plan) {
    settings.head_moves = true;
    plan.faults = {simulator::FaultSpec::parse("slip:joint=r_elbow,value=-12,at=15")};
  });
  const auto report = log.diagnosis();
  ASSERT_FALSE(report.causes.empty()) << report.sentence;
  expect_size(report, {"slip", "r_elbow", ""}, "step", -12.0);
  const auto* slip = test::found(report, {"slip", "r_elbow", ""});
  ASSERT_NE(slip, nullptr);
  EXPECT_NEAR(seconds(*slip->parameters.front().from - report.begin_utime), log.begin_s() + 15.0, 1.0);
  EXPECT_GT(report.after.outline_where_seen, 0.9);
}

/// A model that explains the rest to its noise may be wrong where nothing is seen.
TEST(LongLogDiagnosis, APartOutOfSightIsNotNothing) {
  const test::RenderedLog log([](Settings& settings, Plan& plan) {
    settings.head_moves = true;
    plan.faults = {simulator::FaultSpec::parse("slip:joint=r_elbow,value=40,at=18")};
  });
  EXPECT_NE(log.diagnosis().verdict, "none");
}

TEST(LongLogDiagnosis, AThingThatIsHeldIsSeenWhateverItIs) {
  for (const char* thing : {"held:thing=bottle", "held:thing=box", "held:thing=stick,value=150"}) {
    const test::RenderedLog log([&](Settings&, Plan& plan) { plan.faults = {simulator::FaultSpec::parse(thing)}; });
    const auto report = log.diagnosis();
    EXPECT_EQ(report.verdict, "unexplained") << thing << ": " << report.sentence;
    EXPECT_FALSE(report.not_in_model.empty()) << thing;
  }
}

}  // namespace
}  // namespace bodyschema
