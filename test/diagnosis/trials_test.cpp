#include "bodyschema/diagnosis/trials.hpp"

#include <gtest/gtest.h>

#include <iostream>

#include "diagnosis/trial_robot.hpp"

namespace bodyschema {
namespace {

TEST(Trials, AFewOfEveryRowGoWell) {
  const auto outcomes = run_diagnosis_trials(test::robot(), trial_counts(6), test::seed(), 2,
                                             silhouette_logs(test::robot()));
  const auto r = rates(outcomes);
  EXPECT_EQ(r.trials[static_cast<std::size_t>(TrialRow::kSingle)], 6u);
  EXPECT_EQ(r.trials[static_cast<std::size_t>(TrialRow::kNull)], 4u);
  // At the demanded rates fewer than one run in a thousand fails; a guess fails nearly always.
  EXPECT_LE(r.null_false_alarm, 2.0 / 4.0);
  EXPECT_GE(r.single_in_class, 3.0 / 6.0);
  EXPECT_LE(r.single_wrong, 2.0 / 6.0);
  for (const auto& o : outcomes) {
    if (o.row != TrialRow::kSingle || in_class(o.report, o.truth[0])) continue;
    std::cout << o.truth[0].cause.text() << " " << o.truth[0].value << ", seed " << o.seed << ": "
              << o.report.sentence << std::endl;
  }
}

TEST(Trials, DoNotDependOnThreads) {
  const auto one = run_diagnosis_trials(test::robot(), trial_counts(1), 3, 1, silhouette_logs(test::robot()));
  const auto two = run_diagnosis_trials(test::robot(), trial_counts(1), 3, 2, silhouette_logs(test::robot()));
  ASSERT_EQ(one.size(), two.size());
  for (std::size_t i = 0; i < one.size(); ++i) {
    EXPECT_EQ(one[i].report.sentence, two[i].report.sentence);
    EXPECT_EQ(one[i].report.after.rms_px, two[i].report.after.rms_px);
  }
}

}  // namespace
}  // namespace bodyschema
