#include "diagnosis_trials.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace bodyschema::diagnosis_trials {
namespace {

using simulator::FaultSpec;

DiagnosedCause named(const CauseName& name) {
  DiagnosedCause cause;
  cause.cause = name;
  cause.same = {name};
  return cause;
}

Outcome outcome(const char* fault, RightAnswers answers, std::vector<DiagnosedCause> causes) {
  Outcome o;
  o.row = kSingle;
  o.faults = {FaultSpec::parse(fault)};
  o.answers = {std::move(answers)};
  o.report.verdict = causes.empty() ? "none" : "named";
  o.report.causes = std::move(causes);
  return o;
}

const CauseName kLatency{"latency", "", ""}, kGain{"encoder_gain", "elbow", ""}, kCover{"mesh_scale", "", "hand"},
    kBias{"silhouette_bias", "", "hand"};

TEST(DiagnosisTrials, WhatIsNamedIsRightOrWrong) {
  const auto right = outcome("latency:value=40", {kLatency}, {named(kLatency)});
  EXPECT_TRUE(is_found(right, 0));
  EXPECT_TRUE(is_first(right));
  EXPECT_FALSE(is_wrong(right));
  const auto wrong = outcome("latency:value=40", {kLatency}, {named(kGain)});
  EXPECT_FALSE(is_found(wrong, 0));
  EXPECT_TRUE(is_wrong(wrong));
  auto second = outcome("latency:value=40", {kLatency}, {named(kGain)});
  second.report.causes[0].same.push_back(kLatency);
  EXPECT_TRUE(is_found(second, 0));
  EXPECT_FALSE(is_first(second));
  EXPECT_FALSE(is_wrong(second));
}

/// A neck that stands off is in the state of every log: the answer says so beside "none", rightly or wrongly.
TEST(DiagnosisTrials, WhatIsSaidOfTheStateCounts) {
  const CauseName neck{"head_offset", "neck_pitch", ""};
  auto right = outcome("head_offset:joint=neck_pitch,value=2", {neck}, {});
  right.report.estimated = {named(neck)};
  EXPECT_TRUE(is_named(right) && is_found(right, 0) && is_first(right));
  EXPECT_FALSE(is_wrong(right));
  auto wrong = outcome("latency:value=40", {kLatency}, {named(kLatency)});
  wrong.report.estimated = {named(neck)};
  EXPECT_TRUE(is_first(wrong) && is_wrong(wrong));
  Outcome healthy;
  healthy.report.verdict = "none";
  EXPECT_FALSE(is_named(healthy));
  healthy.report.estimated = {named(neck)};
  EXPECT_TRUE(is_named(healthy));
}

TEST(DiagnosisTrials, OfACoverThePartIsTheAnswer) {
  EXPECT_TRUE(is_first(outcome("cover_dilation:part=hand,value=2", {kCover, kBias}, {named(kCover)})));
}

/// A joint that creeps while the arm comes into view is not told to creep faster.
TEST(DiagnosisTrials, ADriftIsComparedOverTheTimeThatItIsToldFor) {
  DiagnosedParameter told;
  told.duration_s = 60.7;
  EXPECT_NEAR(hidden_size(FaultSpec::parse("drift:joint=elbow,value=8.4"), told, 59.9), 8.4 * 60.7 / 59.9, 1e-12);
  EXPECT_EQ(hidden_size(FaultSpec::parse("encoder_gain:joint=elbow,value=2"), {}, 59.9), 2.0);
}

/// What an unexplained answer lists stands in for something: it neither finds nor errs.
TEST(DiagnosisTrials, WhatTheAnswerDoesNotStandBehindCountsForNothing) {
  auto o = outcome("latency:value=40", {kLatency}, {named(kLatency), named(kGain)});
  o.report.verdict = "unexplained";
  EXPECT_FALSE(is_found(o, 0));
  EXPECT_FALSE(is_wrong(o));
}

TEST(DiagnosisTrials, AThingThatIsHeldIsFoundWhereSomethingIsSaidToBeThere) {
  auto o = outcome("held:thing=stick", {}, {});
  EXPECT_FALSE(is_found(o, 0));
  EXPECT_GT(record_of(line_of(o)).size(), 1.0);
  o.report.verdict = "unexplained";
  o.report.not_in_model = "14 cm2 beside the robot";
  EXPECT_TRUE(is_first(o));
}

/// A mask of the robot alone has nothing that lies beside it: asked for a box there, the diagnosis was always wrong.
TEST(DiagnosisTrials, HeldThingsAreDrawnWherePicturesShowThem) {
  const auto held = [](bool masks) {
    const auto drawn = covers_and_cameras(masks);
    return std::count_if(drawn.begin(), drawn.end(),
                         [](const Drawn& d) { return FaultSpec::parse(d.spec).name == "held"; });
  };
  EXPECT_EQ(held(true), 0);
  EXPECT_GT(held(false), 0);
}

/// A run that is stopped leaves lines; the tables are made of them alone.
TEST(DiagnosisTrials, ALineHoldsWhatTheTablesAsk) {
  auto cause = named(kLatency);
  cause.parameters = {{.parameter = "delay", .unit = "ms", .estimate = 39.0, .ci95 = {37.0, 41.0}}};
  auto o = outcome("latency:value=40", {kLatency}, {cause, named(kGain)});
  o.official = true;
  o.size_mm = 3.0;
  o.size_px = 0.5;
  const auto r = record_of(Json::parse(line_of(o).dump()));
  EXPECT_EQ(r.row, kSingle);
  EXPECT_TRUE(r.official && r.named && r.first && r.wrong && r.found.at(0));
  EXPECT_FALSE(r.large_gain || r.held);
  EXPECT_EQ(r.verdict, "named");
  EXPECT_DOUBLE_EQ(r.size(), 1.5);
  ASSERT_EQ(r.sizes.size(), 1u);
  EXPECT_DOUBLE_EQ(r.sizes[0].estimate, 39.0);
  EXPECT_DOUBLE_EQ(r.sizes[0].width, 4.0);
  EXPECT_DOUBLE_EQ(r.sizes[0].truth, 40.0);
}

TEST(DiagnosisTrials, OutsideTheCatalogueTheJointIsEnough) {
  auto o = outcome("wobble:joint=elbow,value=1", {{"wobble", "elbow", ""}}, {named(kGain)});
  EXPECT_FALSE(is_not_explained_away(o)) << "one name for it is wrong";
  o.report.verdict = "class";
  EXPECT_TRUE(is_not_explained_away(o));
  o.report.causes = {named(kLatency)};
  EXPECT_FALSE(is_not_explained_away(o));
  o.report.verdict = "unexplained";
  EXPECT_TRUE(is_not_explained_away(o));
}

}  // namespace
}  // namespace bodyschema::diagnosis_trials
