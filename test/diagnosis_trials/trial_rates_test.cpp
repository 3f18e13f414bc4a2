#include <gtest/gtest.h>

#include <cmath>

#include "bodyschema/diagnosis_trials/trials.hpp"

namespace bodyschema {
namespace {

const CauseName kGain{"encoder_gain", "r_elbow", ""}, kEccentric{"eccentricity", "r_elbow", ""},
    kLatency{"latency", "", ""}, kDrift{"drift", "r_elbow", ""};

DiagnosedCause cause(const CauseName& name, double estimate, double half, std::vector<CauseName> others = {}) {
  DiagnosedCause c;
  c.cause = name;
  c.parameters = {{name.name == "eccentricity" ? "sine" : "value", "", estimate, {estimate - half, estimate + half}}};
  c.same = {name};
  c.same.insert(c.same.end(), others.begin(), others.end());
  c.heldout_gain = 0.2;
  return c;
}

TrialOutcome outcome(TrialRow row, std::vector<TrialFault> truth, std::vector<DiagnosedCause> causes) {
  TrialOutcome o;
  o.row = row;
  o.truth = std::move(truth);
  o.report.causes = std::move(causes);
  return o;
}

TEST(TrialRates, CountWhatTheTableCounts) {
  const TrialFault gain{kGain, 4.0, 0.0, 1.0}, latency{kLatency, 30.0, 0.0, 5.0};
  const auto r = rates({
      outcome(TrialRow::kNull, {}, {}),
      outcome(TrialRow::kNull, {}, {cause(kDrift, 1.0, 0.1)}),
      outcome(TrialRow::kSingle, {gain}, {cause(kGain, 4.1, 0.2)}),              // right
      outcome(TrialRow::kSingle, {gain}, {cause(kLatency, 9.0, 1.0, {kGain})}),  // in the class, second
      outcome(TrialRow::kSingle, {gain}, {cause(kEccentric, 1.0, 0.1)}),         // counts as one
      outcome(TrialRow::kSingle, {gain}, {cause(kDrift, 1.0, 0.1)}),             // wrong
      outcome(TrialRow::kSingle, {gain}, {}),                                    // missed, not wrong
      outcome(TrialRow::kTwo, {gain, latency}, {cause(kGain, 3.0, 0.5), cause(kLatency, -30.0, 1.0)}),
      outcome(TrialRow::kTwo, {gain, latency}, {cause(kGain, 4.0, 0.5), cause(kDrift, 1.0, 0.1)}),
  });
  EXPECT_DOUBLE_EQ(r.null_false_alarm, 0.5);
  EXPECT_DOUBLE_EQ(r.single_in_class, 0.6);
  EXPECT_DOUBLE_EQ(r.single_exact, 0.4);
  EXPECT_DOUBLE_EQ(r.single_wrong, 0.2);
  EXPECT_DOUBLE_EQ(r.single_mean_class, 4.0 / 3.0);
  EXPECT_DOUBLE_EQ(r.two_both, 0.5);
  EXPECT_DOUBLE_EQ(r.two_spurious, 0.5);
  // 4.1, 3, -30 and 4 were estimated for 4, 4, 30 and 4.
  EXPECT_EQ(r.parameters, 4u);
  EXPECT_DOUBLE_EQ(r.sign, 0.75);
  EXPECT_DOUBLE_EQ(r.coverage95, 0.5);
  EXPECT_TRUE(std::isnan(r.limit_wrong));
}

TEST(TrialRates, ARefusalIsAFailureInEveryRow) {
  std::vector<TrialOutcome> outcomes;
  const TrialFault gain{kGain, 4.0, 0.0, 1.0}, wobble{{"wobble", "r_elbow", ""}, 1.0, 2.0, 0.0};
  for (std::size_t row = 0; row < kTrialRows; ++row) {
    std::vector<TrialFault> truth = {row >= static_cast<std::size_t>(TrialRow::kOutside) ? wobble : gain};
    if (static_cast<TrialRow>(row) == TrialRow::kTwo) truth.push_back({kLatency, 30.0, 0.0, 5.0});
    outcomes.push_back(outcome(static_cast<TrialRow>(row), truth, {}));
    outcomes.back().refused = true;
  }
  const auto r = rates(outcomes);
  for (const auto refused : r.refused) EXPECT_EQ(refused, 1u);
  EXPECT_DOUBLE_EQ(r.null_false_alarm, 1.0);
  EXPECT_DOUBLE_EQ(r.background_named, 1.0);
  EXPECT_DOUBLE_EQ(r.single_in_class, 0.0);
  EXPECT_DOUBLE_EQ(r.limit_wrong, 1.0);
  EXPECT_DOUBLE_EQ(r.two_both, 0.0);
  EXPECT_DOUBLE_EQ(r.outside_unexplained, 0.0);
  EXPECT_DOUBLE_EQ(r.outside_hard_class_or_unexplained, 0.0);
}

TEST(TrialRates, OutsideTheCatalogueUnexplainedIsRight) {
  DiagnosedCause unexplained;
  unexplained.cause = {"unexplained", "r_elbow", ""};
  unexplained.variable = "angle";
  unexplained.same = {unexplained.cause};
  const TrialFault kink{{"local_kink", "r_elbow", ""}, 1.0, 0.0, 0.0}, wobble{{"wobble", "r_elbow", ""}, 1.0, 2.0, 0.0};
  const auto r = rates({outcome(TrialRow::kOutside, {wobble}, {unexplained}),
                        outcome(TrialRow::kOutside, {wobble}, {cause(kDrift, 1.0, 0.1)}),
                        outcome(TrialRow::kOutsideHard, {kink}, {unexplained}),
                        outcome(TrialRow::kOutsideHard, {kink}, {cause(kGain, 1.0, 0.1)}),
                        outcome(TrialRow::kOutsideHard, {kink}, {cause(kDrift, 1.0, 0.1)})});
  EXPECT_DOUBLE_EQ(r.outside_unexplained, 0.5);
  EXPECT_DOUBLE_EQ(r.outside_hard_joint, 2.0 / 3.0);  // a gain is the right joint and variable
  EXPECT_DOUBLE_EQ(r.outside_hard_class_or_unexplained, 1.0 / 3.0);
}

}  // namespace
}  // namespace bodyschema
