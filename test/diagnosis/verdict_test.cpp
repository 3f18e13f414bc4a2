#include "verdict.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

namespace bodyschema::diagnosis {
namespace {

using testing::HasSubstr;
using testing::Not;

DiagnosisReport report_of(double left_px, std::vector<DiagnosedCause> causes) {
  DiagnosisReport report;
  report.after.rms_px = left_px;
  report.causes = std::move(causes);
  return report;
}

DiagnosedCause gain_of_elbow() {
  DiagnosedCause cause;
  cause.cause = {"encoder_gain", "r_elbow", ""};
  cause.parameters = {{"gain", "%", 4.0, {3.5, 4.5}}};
  cause.same = {cause.cause};
  return cause;
}

DiagnosisOptions picture_options() {
  DiagnosisOptions options;
  options.noise_rms_px = 0.5;
  options.trusted_rms_px = 0.8;
  options.trusted_outline = 0.75;
  return options;
}

TEST(Verdict, NamesACauseWithItsInterval) {
  auto report = report_of(0.3, {gain_of_elbow()});
  word_verdict(report, picture_options());
  EXPECT_EQ(report.verdict, "named");
  EXPECT_EQ(report.sentence, "The log asks for: encoder_gain of r_elbow gain 4 % [3.5, 4.5].");
}

TEST(Verdict, SaysWhenAJointSlipped) {
  DiagnosedCause cause;
  cause.cause = {"slip", "r_elbow", ""};
  cause.parameters = {{"step", "deg", 2.0, {1.9, 2.1}, Microseconds{1'600'000'048'700'000}}};
  cause.same = {cause.cause};
  auto report = report_of(0.3, {cause});
  report.begin_utime = 1'600'000'000'000'000;
  word_verdict(report, picture_options());
  EXPECT_EQ(report.sentence, "The log asks for: slip of r_elbow step 2 deg [1.9, 2.1] 48.7 s into the log.");
  EXPECT_THAT(report.to_json(), HasSubstr("\"from_utime\": 1600000048700000"));
}

TEST(Verdict, SaysOverWhichSpanAJointDrifted) {
  DiagnosedCause cause;
  cause.cause = {"drift", "r_elbow", ""};
  cause.parameters = {{"change", "deg/log", 2.0, {1.9, 2.1}, Microseconds{1'600'000'003'500'000}, 50.5}};
  cause.same = {cause.cause};
  auto report = report_of(0.3, {cause});
  report.begin_utime = 1'600'000'000'000'000;
  word_verdict(report, picture_options());
  EXPECT_EQ(report.sentence,
            "The log asks for: drift of r_elbow change 2 deg/log [1.9, 2.1] from 3.5 to 54.0 s into the log.");
  EXPECT_THAT(report.to_json(), HasSubstr("\"from_utime\": 1600000003500000"));
  EXPECT_THAT(report.to_json(), HasSubstr("\"duration_s\": 50.5"));
}

TEST(Verdict, SaysAClassWhereSeveralFit) {
  auto cause = gain_of_elbow();
  cause.same.push_back({"eccentricity", "r_elbow", ""});
  auto report = report_of(0.3, {cause});
  word_verdict(report, picture_options());
  EXPECT_EQ(report.verdict, "class");
  EXPECT_THAT(report.sentence, HasSubstr("(or eccentricity of r_elbow, which this log cannot tell from it)"));
}

TEST(Verdict, TrustsNoNameWhereTheFitStillMissesTheOutlines) {
  auto report = report_of(1.3, {gain_of_elbow()});
  word_verdict(report, picture_options());
  EXPECT_EQ(report.verdict, "unexplained");
  EXPECT_THAT(report.sentence, HasSubstr("1.3 px"));
  EXPECT_THAT(report.sentence, HasSubstr("encoder_gain of r_elbow"));
}

/// A kink of 1.5 deg in an elbow was named an eccentricity of 16 deg.
TEST(Verdict, TrustsNoNameOfASizeThatNoRobotHas) {
  auto cause = gain_of_elbow();
  cause.implausible = true;
  auto report = report_of(0.3, {cause});
  word_verdict(report, picture_options());
  EXPECT_EQ(report.verdict, "unexplained");
  EXPECT_THAT(report.sentence, HasSubstr("larger than on any robot"));
  EXPECT_THAT(report.sentence, HasSubstr("encoder_gain of r_elbow gain 4 %"));
}

TEST(Verdict, TrustsNoNameWhereMuchOfTheOutlineIsMissing) {
  for (const bool with_cause : {true, false}) {
    auto report = report_of(0.3, {});
    if (with_cause) report.causes = {gain_of_elbow()};
    report.after.outline_where_seen = 0.67;
    word_verdict(report, picture_options());
    EXPECT_EQ(report.verdict, "unexplained");
    EXPECT_THAT(report.sentence, HasSubstr("only 67 %"));
    EXPECT_THAT(report.to_json(), HasSubstr("\"outline_where_seen\": 0.67"));  // what the rule goes by
    EXPECT_EQ(report.sentence.find("encoder_gain of r_elbow") != std::string::npos, with_cause);
  }
}

TEST(Verdict, SaysNoiseOnlyWhereNoiseIsAllThatIsLeft) {
  auto good = report_of(0.3, {});
  word_verdict(good, picture_options());
  EXPECT_EQ(good.verdict, "none");
  EXPECT_THAT(good.sentence, HasSubstr("to its noise"));

  auto more = report_of(0.65, {});
  word_verdict(more, picture_options());
  EXPECT_EQ(more.verdict, "unexplained");
  EXPECT_THAT(more.sentence, Not(HasSubstr("to its noise")));
  EXPECT_THAT(more.sentence, HasSubstr("0.65 px"));

  for (const double left_px : {0.3, 0.65}) {
    auto crowd = report_of(left_px, {});
    crowd.crowded = true;
    word_verdict(crowd, picture_options());
    EXPECT_EQ(crowd.verdict, "none");
    EXPECT_THAT(crowd.sentence, HasSubstr("several small errors"));
    EXPECT_THAT(crowd.to_json(), HasSubstr("\"crowded\": true"));
  }

  auto named = report_of(0.65, {gain_of_elbow()});
  word_verdict(named, picture_options());
  EXPECT_EQ(named.verdict, "named");
  EXPECT_THAT(named.sentence, HasSubstr("something else is wrong too"));
}

TEST(Verdict, OfAPartOutOfSightNothingIsKnown) {
  auto report = report_of(0.3, {});
  report.out_of_sight = PartOutOfSight{50.5, 60.0, 0.16};
  word_verdict(report, picture_options());
  EXPECT_EQ(report.verdict, "unexplained");
  EXPECT_THAT(report.sentence, HasSubstr("from 50.5 to 60.0 s the outlines are out of sight"));
  // What was found elsewhere stands; the warning says the rest.
  report.causes = {gain_of_elbow()};
  word_verdict(report, picture_options());
  EXPECT_EQ(report.verdict, "named");
}

TEST(Verdict, NamesNoCauseOfWhichTheSizeIsNotKnown) {
  auto cause = gain_of_elbow();
  const double inf = std::numeric_limits<double>::infinity();
  cause.parameters[0].ci95 = {-inf, inf};
  auto report = report_of(0.3, {cause});
  word_verdict(report, picture_options());
  EXPECT_EQ(report.verdict, "unexplained");
  EXPECT_THAT(report.sentence, HasSubstr("of a size that this log does not tell"));
  EXPECT_THAT(report.sentence, Not(HasSubstr("inf")));
}

TEST(Verdict, SaysWhatAnUnknownStructureFollows) {
  DiagnosedCause cause;
  cause.cause = {"unexplained", "r_elbow", ""};
  cause.variable = "velocity";
  cause.same = {cause.cause};
  auto report = report_of(0.3, {cause});
  word_verdict(report, picture_options());
  EXPECT_EQ(report.verdict, "unexplained");
  EXPECT_THAT(report.sentence, HasSubstr("follows the velocity of r_elbow"));
}

}  // namespace
}  // namespace bodyschema::diagnosis
