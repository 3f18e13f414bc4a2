#include "bodyschema/diagnosis/log_comparison.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "effects/roles.hpp"

namespace bodyschema {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

DiagnosedCause gain(double estimate, double half) {
  DiagnosedCause cause;
  cause.cause = {"encoder_gain", "elbow", ""};
  cause.parameters = {{"gain", "%", estimate, {estimate - half, estimate + half}}};
  cause.same = {cause.cause};
  cause.sentence = "elbow turns further";
  return cause;
}

DiagnosisReport log_with(std::vector<DiagnosedCause> causes, std::map<std::string, double> offsets = {}) {
  DiagnosisReport report;
  report.verdict = causes.empty() ? "none" : "named";
  report.causes = std::move(causes);
  report.offsets_deg_after = offsets;
  for (const auto& [joint, offset] : offsets) report.offsets_ci95_deg[joint] = {offset - 0.1, offset + 0.1};
  return report;
}

LogComparison compared(const std::vector<DiagnosisReport>& reports) {
  return compare(reports, {"first", "second"}, test::roles());
}

TEST(LogComparison, WhatBothHaveIsTheRobots) {
  const auto c = compared({log_with({gain(4.0, 0.4)}), log_with({gain(4.4, 0.2)})});
  ASSERT_EQ(c.common.size(), 1u);
  // By how well each knows it.
  EXPECT_NEAR(c.common[0].cause.parameters[0].estimate, 4.32, 1e-9);
  EXPECT_LT(c.common[0].cause.parameters[0].ci95[1] - 4.32, 0.2);
  EXPECT_THAT(c.sentence, testing::StartsWith("In all logs: elbow turns 4.32 %"));
}

TEST(LogComparison, ASecondLogContradictsDiffersOrCannotTell) {
  const auto first = log_with({gain(4.0, 0.4)});
  auto second = log_with({});
  second.estimates = {gain(0.1, 0.3)};
  auto c = compared({first, second});
  ASSERT_EQ(c.claims.size(), 1u);
  EXPECT_EQ(c.claims[0].judgement, Judgement::kContradicts);
  EXPECT_THAT(c.sentence, HasSubstr("second contradicts first: elbow turns further (gain 0.1 % (-0.2 to 0.4) there)"));
  second.estimates = {gain(2.0, 3.0)};
  EXPECT_EQ(compared({first, second}).claims[0].judgement, Judgement::kNothing);
  second.estimates = {gain(3.8, 0.5)};
  EXPECT_EQ(compared({first, second}).claims[0].judgement, Judgement::kAgrees);
  EXPECT_EQ(compared({first, log_with({gain(9.0, 0.4)})}).claims[0].judgement, Judgement::kDiffers);
  second.estimates.clear();
  second.not_testable = {{{"encoder_gain", "elbow", ""}, "elbow moved 0.4 deg"}};
  c = compared({first, second});
  EXPECT_EQ(c.claims[0].judgement, Judgement::kNothing);
  EXPECT_THAT(c.claims[0].why, HasSubstr("moved 0.4 deg"));
}

TEST(LogComparison, AnOffsetThatChangedSlippedBetweenThem) {
  const auto c =
      compared({log_with({}, {{"elbow", 1.0}, {"prosup", 2.0}}), log_with({}, {{"elbow", 3.0}, {"prosup", 2.1}})});
  ASSERT_EQ(c.changes.size(), 1u);
  EXPECT_EQ(c.changes[0].joint, "elbow");
  EXPECT_NEAR(c.changes[0].change_deg, 2.0, 1e-9);
  EXPECT_THAT(c.sentence, HasSubstr("Between first and second elbow slipped: its encoder reads 2.00 deg"));
  EXPECT_THAT(c.to_json(), HasSubstr("\"change_deg\": 2.0"));
}

/// Other postures show other errors of the model: logs differ by more than each of them knows.
TEST(LogComparison, WhatAllOffsetsDoIsNoSlip) {
  const std::map<std::string, double> first = {{"s_pitch", 0.0}, {"s_roll", 0.0}, {"s_yaw", 0.0}, {"elbow", 0.0}},
                                      second = {{"s_pitch", 0.3}, {"s_roll", -0.3}, {"s_yaw", 0.3}, {"elbow", 2.5}};
  const auto c = compared({log_with({gain(4.0, 0.1)}, first), log_with({gain(4.3, 0.1)}, second)});
  ASSERT_EQ(c.changes.size(), 1u) << c.sentence;
  EXPECT_EQ(c.changes[0].joint, "elbow");
  EXPECT_EQ(c.common.size(), 1u) << "sizes are told no better than offsets";
}

/// The offset before a slip is not the one after it.
TEST(LogComparison, ASlipWithinALogIsNoneBetweenThem) {
  DiagnosedCause slip;
  slip.cause = {"slip", "elbow", ""};
  slip.parameters = {{"step", "deg", -2.0, {-2.1, -1.9}, Microseconds{1}}};
  const auto c = compared({log_with({slip}, {{"elbow", 1.0}}), log_with({}, {{"elbow", 3.0}})});
  EXPECT_THAT(c.changes, IsEmpty());
  EXPECT_THAT(c.claims, IsEmpty()) << "it happened once";
}

TEST(LogComparison, OffsetsBesideACauseThatOnlyOneLogHasAreNotCompared) {
  auto first = log_with({gain(4.0, 0.4)}, {{"elbow", 1.0}});
  auto second = log_with({}, {{"elbow", 3.0}});
  second.not_testable = {{{"encoder_gain", "elbow", ""}, "elbow moved 0.4 deg"}};
  const auto c = compared({first, second});
  EXPECT_THAT(c.changes, IsEmpty());
  EXPECT_THAT(c.not_compared, testing::ElementsAre("elbow"));
}

TEST(LogComparison, ALogThatIsNotExplainedNeitherClaimsNorJudges) {
  auto strange = log_with({gain(4.0, 0.4)}, {{"elbow", 1.0}});
  strange.verdict = "unexplained";
  const auto c = compared({log_with({gain(4.0, 0.4)}, {{"elbow", 3.0}}), strange});
  ASSERT_EQ(c.claims.size(), 1u);
  EXPECT_EQ(c.claims[0].judgement, Judgement::kNothing);
  EXPECT_THAT(c.changes, IsEmpty());
  EXPECT_THAT(compared({log_with({}), log_with({})}).sentence, HasSubstr("Nothing was found in any"));
}

}  // namespace
}  // namespace bodyschema
