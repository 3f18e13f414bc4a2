#include "verdict.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <gtest/gtest.h>

#include "effects/roles.hpp"

namespace bodyschema::diagnosis {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

DiagnosisReport report_of(std::vector<DiagnosedCause> causes) {
  DiagnosisReport report;
  report.after.rms_px = 0.3;
  report.causes = std::move(causes);
  report.exclusion_limits = {{{"backlash", "elbow", ""}, "width", "deg", 0.2}};
  return report;
}

DiagnosisReport worded(DiagnosisReport report) {
  word_verdict(report, test::roles());
  return report;
}

DiagnosedCause gain_of_elbow() {
  DiagnosedCause cause;
  cause.cause = {"encoder_gain", "elbow", ""};
  cause.parameters = {{"gain", "%", 4.0, {3.5, 4.5}}};
  cause.same = {cause.cause};
  return cause;
}

TEST(Verdict, IsASentenceWithSizeIntervalAndDirection) {
  auto report = worded(report_of({gain_of_elbow()}));
  EXPECT_EQ(report.verdict, "named");
  EXPECT_EQ(report.sentence, "Elbow turns 4 % (3.5 to 4.5) further than its encoder says.");
  EXPECT_EQ(report.causes[0].sentence, "elbow turns 4 % (3.5 to 4.5) further than its encoder says");
  // A size has no sign: the word says which way.
  auto less = gain_of_elbow();
  less.parameters = {{"gain", "%", -4.0, {-4.5, -3.5}}};
  report = worded(report_of({less}));
  EXPECT_EQ(report.sentence, "Elbow turns 4 % (3.5 to 4.5) less far than its encoder says.");
  EXPECT_FALSE(report.exclusion_limits.empty()) << "a model that explains the log excludes the rest";
}

TEST(Verdict, OfASizeThatMayBeNoneSaysUpToWhat) {
  auto cause = gain_of_elbow();
  cause.parameters = {{"gain", "%", -0.3, {-0.9, 0.3}}};
  EXPECT_THAT(worded(report_of({cause})).sentence, HasSubstr("0.3 % (at most 0.9)"));
}

TEST(Verdict, NamesSeveralCausesInOneSentence) {
  DiagnosedCause latency;
  latency.cause = {"latency", "", ""};
  latency.parameters = {{"delay", "ms", 58.0, {57.0, 59.0}}};
  latency.same = {latency.cause};
  const auto report = worded(report_of({latency, gain_of_elbow()}));
  EXPECT_EQ(report.verdict, "named");
  EXPECT_EQ(report.sentence,
            "Pictures arrive 58 ms (57 to 59) late against the encoders; elbow turns 4 % (3.5 to 4.5) further than its "
            "encoder says.");
}

/// What the state takes up is no cause beside it, and no reason to call the robot right either.
TEST(Verdict, SaysWhatIsEstimatedInAnyCaseAndStandsOut) {
  auto report = report_of({});
  report.estimated = {gain_of_elbow()};
  report = worded(report);
  EXPECT_EQ(report.verdict, "none");
  EXPECT_THAT(report.sentence, HasSubstr("nothing but what is estimated in any case was found"));
  EXPECT_THAT(report.sentence, HasSubstr("the pictures ask for: elbow turns 4 % (3.5 to 4.5) further"));
  EXPECT_THAT(worded(report_of({})).sentence, HasSubstr("nothing but joint offsets was found"));
}

/// A mended robot that still leaves much of its outlines unexplained has something standing in for something else.
TEST(Verdict, OfAModelThatLeavesMoreThanAnyOutlineIsRoughNothingIsNamed) {
  auto report = report_of({gain_of_elbow()});
  report.rough_px = 1.5;
  report.left_px = 3.5;
  report.noise_px = 3.4;
  report = worded(report);
  EXPECT_EQ(report.verdict, "unexplained");
  EXPECT_THAT(report.sentence, HasSubstr("3.50 px"));
  EXPECT_THAT(report.sentence, HasSubstr("may only stand in for it: elbow turns"));
  EXPECT_TRUE(report.exclusion_limits.empty());
}

/// A wobble that no angle, speed or load goes with: every instant has its own offset.
TEST(Verdict, OfARobotThatStandsElsewhereFromInstantToInstantIsNeitherNoneNorNamed) {
  for (auto causes : {std::vector<DiagnosedCause>{}, {gain_of_elbow()}}) {
    auto report = report_of(causes);
    report.after.rms_px = 0.8;
    report.after.moved_px = 0.7;
    EXPECT_EQ(worded(report).verdict, "unexplained");
    report.after.moved_px = 0.3;
    EXPECT_NE(worded(report).verdict, "unexplained");
    // What encoders do not tell is no motion that the model lacks.
    report.after.moved_px = 0.7;
    report.after.encoders_px = 0.75;
    EXPECT_NE(worded(report).verdict, "unexplained");
  }
}

/// Of a log in which nothing but this stands out.
DiagnosisReport of_small_cause(const DiagnosedCause& cause) {
  auto report = report_of({});
  report.small_causes = {cause};
  return worded(report);
}

/// Meshes 3.4 % larger with a focal length 4.8 % longer: the hand was 4.3 mm off along the line of sight.
TEST(Verdict, IsNotNoneWhereTheHandIsOffByWhatMattersAndOutlinesHardlyShowIt) {
  auto cause = gain_of_elbow();
  cause.hand_mm = 4.3;
  cause.outline_px = 0.08;
  const auto report = of_small_cause(cause);
  EXPECT_EQ(report.verdict, "unexplained");
  EXPECT_THAT(report.sentence,
              HasSubstr("by 0.08 px, which is less than any picture places them, but the hand by 4.3 mm"));
  EXPECT_THAT(report.sentence, HasSubstr("elbow turns roughly 4 %"));
  EXPECT_TRUE(report.exclusion_limits.empty());
  cause.hand_mm = 0.4;
  EXPECT_EQ(of_small_cause(cause).verdict, "none");
}

/// An elbow's play was named, and of a principal point 7 px aside, by which the hand was 4.4 mm off, nothing said.
TEST(Verdict, BesideANameSaysWhatMayMoveTheHandUnseen) {
  auto report = report_of({gain_of_elbow()});
  DiagnosedCause unseen;
  unseen.cause = {"latency", "", ""};
  unseen.parameters = {{"delay", "ms", 58.0, {57.0, 59.0}}};
  unseen.hand_mm = 4.35;
  unseen.outline_px = 0.064;
  report.small_causes = {unseen};
  auto seen = worded(report);
  EXPECT_EQ(seen.verdict, "named");
  EXPECT_THAT(seen.sentence,
              HasSubstr("Not told is whether pictures arrive 58 ms (57 to 59) late against the encoders"));
  EXPECT_THAT(seen.sentence, HasSubstr("the hand by 4.3 mm, but outlines by 0.064 px"));
  report.small_causes[0].hand_mm = 0.4;
  EXPECT_THAT(worded(report).sentence, Not(HasSubstr("Not told")));
}

/// A wrist that lagged with its acceleration: a curve over another joint's took up a part of it that moved next to
/// nothing.
TEST(Verdict, IsNotNoneWhereSomethingStandsOutThatNoCauseDescribes) {
  auto cause = gain_of_elbow();
  cause.cause = {"unexplained", "elbow", ""};
  cause.variable = "acceleration";
  cause.parameters.clear();
  cause.hand_mm = 0.1;
  cause.outline_px = 0.02;
  const auto report = of_small_cause(cause);
  EXPECT_EQ(report.verdict, "unexplained");
  EXPECT_THAT(report.sentence, HasSubstr("Something follows the acceleration of elbow"));
  EXPECT_TRUE(report.exclusion_limits.empty());
}

/// Six causes and a seventh that is asked for: one of the six may have a part of it.
TEST(Verdict, OfALogThatAsksForMoreThanAModelHoldsNothingIsNamed) {
  auto report = report_of({gain_of_elbow()});
  report.more_asked = true;
  report = worded(report);
  EXPECT_EQ(report.verdict, "unexplained");
  EXPECT_THAT(report.sentence, testing::StartsWith("More is wrong than 6 causes explain"));
  EXPECT_TRUE(report.exclusion_limits.empty());
}

TEST(Verdict, KeepsTheLettersOfAJointsName) {
  DiagnosedCause cause = gain_of_elbow();
  cause.cause.joint = "w_yaw";
  cause.same = {cause.cause};
  EXPECT_THAT(worded(report_of({cause})).sentence, testing::StartsWith("w_yaw turns"));
}

TEST(Verdict, SaysWhenAJointSlippedAndOverWhichSpanItDrifted) {
  DiagnosedCause slip, drift;
  slip.cause = {"slip", "elbow", ""};
  slip.parameters = {{"step", "deg", 2.0, {1.9, 2.1}, 0.05, Microseconds{1'600'000'048'700'000}}};
  slip.same = {slip.cause};
  drift.cause = {"drift", "prosup", ""};
  drift.parameters = {{"change", "deg/log", 2.0, {1.9, 2.1}, 0.05, Microseconds{1'600'000'003'500'000}, 50.5}};
  drift.same = {drift.cause};
  auto report = report_of({slip, drift});
  report.begin_utime = 1'600'000'000'000'000;
  report = worded(std::move(report));
  EXPECT_EQ(report.causes[0].sentence, "elbow slipped by 2 deg (1.9 to 2.1), 48.7 s into the log");
  EXPECT_THAT(report.causes[1].sentence, HasSubstr("from 3.5 to 54.0 s into the log"));
}

TEST(Verdict, SaysAClassWhereSeveralFit) {
  auto cause = gain_of_elbow();
  cause.same.push_back({"eccentricity", "elbow", ""});
  cause.same.push_back({"joint_coupling", "elbow", "prosup"});
  const auto report = worded(report_of({cause}));
  EXPECT_EQ(report.verdict, "class");
  EXPECT_THAT(report.sentence,
              HasSubstr("(or eccentricity of elbow, joint coupling of elbow with prosup, which this log cannot "
                        "tell from it)"));
}

/// A kink of 1.5 deg in an elbow was named an eccentricity of 16 deg.
TEST(Verdict, TrustsNoNameOfASizeThatNoRobotHas) {
  auto cause = gain_of_elbow();
  cause.implausible = true;
  const auto report = worded(report_of({cause}));
  EXPECT_EQ(report.verdict, "unexplained");
  EXPECT_THAT(report.sentence, HasSubstr("larger than on any robot"));
  EXPECT_THAT(report.sentence, HasSubstr("may only stand in for it: elbow turns roughly 4 % further"));
  EXPECT_THAT(report.exclusion_limits, IsEmpty());
}

/// 6 kg in the hand, and a joint that turned 29 % less than its encoder said: with them logs were explained to their
/// noise, and nothing was named.
TEST(Verdict, NamesWhatIsLargerThanOnAnyRobotWhereItLeavesNothingButNoise) {
  auto cause = gain_of_elbow();
  cause.implausible = true;
  auto report = report_of({cause});
  report.left_px = 0.29;
  report.noise_px = 0.28;
  report.after.moved_px = 0.1;
  report.after.encoders_px = 0.2;
  EXPECT_EQ(worded(report).verdict, "named");
  EXPECT_THAT(worded(report).sentence, HasSubstr("So much is more than robots are usually off by"));
  // Beside a curve that nobody knows it does not explain all.
  auto with_curve = report;
  with_curve.causes.emplace_back().cause = {"unexplained", "prosup", ""};
  EXPECT_EQ(worded(with_curve).verdict, "unexplained");
  EXPECT_THAT(worded(with_curve).sentence, Not(HasSubstr("explains all that is seen")));
  report.after.moved_px = 0.25;
  EXPECT_THAT(worded(report).sentence, HasSubstr("larger than on any robot"));
  report.after.moved_px = 0.1;
  report.left_px = 0.4;
  EXPECT_THAT(worded(report).sentence, HasSubstr("larger than on any robot"));
}

TEST(Verdict, TrustsNothingWhereMuchOfTheOutlineIsMissing) {
  for (const bool with_cause : {true, false}) {
    auto report = report_of({});
    if (with_cause) report.causes = {gain_of_elbow()};
    report.after.outline_found = 0.47;
    report = worded(std::move(report));
    EXPECT_EQ(report.verdict, "unexplained");
    EXPECT_THAT(report.sentence, HasSubstr("only 47 %"));
    EXPECT_EQ(report.sentence.find("elbow turns") != std::string::npos, with_cause);
    EXPECT_THAT(report.exclusion_limits, IsEmpty());
  }
}

TEST(Verdict, TrustsNothingWhereThePicturesShowMoreThanTheModel) {
  for (const bool with_cause : {true, false}) {
    auto report = report_of({});
    if (with_cause) report.causes = {gain_of_elbow()};
    report.not_in_model = "14 cm2 beside the robot, in 96 % of the log";
    report = worded(std::move(report));
    EXPECT_EQ(report.verdict, "unexplained");
    EXPECT_THAT(report.sentence, HasSubstr("14 cm2 beside the robot"));
    EXPECT_THAT(report.exclusion_limits, IsEmpty());
  }
}

TEST(Verdict, AnOutlineThatLiesOffOnOneSideIsNotExplained) {
  auto report = report_of({});
  report.side_left_over =
      "the left outline of hand lies 0.8 px outside of where the model has it in the pictures of left";
  report = worded(std::move(report));
  EXPECT_EQ(report.verdict, "unexplained");
  EXPECT_THAT(report.sentence, HasSubstr(report.side_left_over));
  EXPECT_THAT(report.exclusion_limits, IsEmpty());
}

TEST(Verdict, WhatIsNotExplainedHasNoIntervals) {
  auto report = report_of({gain_of_elbow()});
  report.side_left_over = "the left outline of hand lies 0.8 px outside of where the model has it";
  report.offsets_ci95_deg = {{"elbow", {1.0, 1.2}}};
  report = worded(std::move(report));
  EXPECT_TRUE(std::isnan(report.causes[0].parameters[0].ci95[0]));
  EXPECT_TRUE(std::isnan(report.offsets_ci95_deg.at("elbow")[1]));
  EXPECT_THAT(report.sentence, Not(HasSubstr("3.5 to 4.5")));
}

/// An error that is alike in every block moves no test between blocks.
TEST(Verdict, MoreThanPixelNoiseIsNotNothing) {
  auto report = report_of({});
  report.noise_px = 0.3;
  report.left_px = 0.36;
  EXPECT_EQ(worded(report).verdict, "none");
  report.left_px = 0.45;
  report = worded(std::move(report));
  EXPECT_EQ(report.verdict, "unexplained");
  EXPECT_THAT(report.sentence, HasSubstr("0.45 px, and but 0.30 px of that differ"));
  EXPECT_THAT(report.exclusion_limits, IsEmpty());
}

TEST(Verdict, SaysWhatAnUnknownStructureFollows) {
  DiagnosedCause cause;
  cause.cause = {"unexplained", "elbow", ""};
  cause.variable = "velocity";
  cause.same = {cause.cause};
  const auto report = worded(report_of({cause, gain_of_elbow()}));
  EXPECT_EQ(report.verdict, "unexplained");
  EXPECT_THAT(report.sentence, HasSubstr("follows the velocity of elbow that no known cause explains"));
  EXPECT_THAT(report.exclusion_limits, IsEmpty());
}

TEST(Verdict, OfNothingSaysSoAndKeepsItsLimits) {
  const auto report = worded(report_of({}));
  EXPECT_EQ(report.verdict, "none");
  EXPECT_THAT(report.sentence, HasSubstr("to its noise"));
  EXPECT_FALSE(report.exclusion_limits.empty());
  // Five stills can test next to nothing, and finding nothing there says as much.
  auto poor = report_of({});
  poor.not_testable = {{{"latency", "", ""}, "the arm stands still"}, {{"slip", "elbow", ""}, "too few postures"}};
  EXPECT_THAT(worded(std::move(poor)).sentence,
              HasSubstr("nothing but joint offsets was found among the 1 causes that it can test (2 that it cannot)."));
}

TEST(Verdict, OfACrowdDoesNotSayThatNothingIsLeft) {
  auto crowd = report_of({});
  crowd.small_causes = {gain_of_elbow()};
  crowd = worded(std::move(crowd));
  EXPECT_EQ(crowd.verdict, "none");
  EXPECT_FALSE(crowd.crowded) << "one is no crowd";
  EXPECT_THAT(crowd.sentence, Not(HasSubstr("to its noise")));
  EXPECT_THAT(crowd.sentence, HasSubstr("by less than any picture places them: elbow turns 4 %"));
  crowd.small_causes.push_back(gain_of_elbow());
  crowd = worded(std::move(crowd));
  EXPECT_TRUE(crowd.crowded);
  EXPECT_THAT(crowd.to_json(), HasSubstr("\"crowded\": true"));
  // Beside a cause that stands out they are no news.
  auto named = report_of({gain_of_elbow()});
  named.small_causes = crowd.small_causes;
  named = worded(std::move(named));
  EXPECT_FALSE(named.crowded);
  EXPECT_THAT(named.sentence, Not(HasSubstr("less than")));
}

}  // namespace
}  // namespace bodyschema::diagnosis
