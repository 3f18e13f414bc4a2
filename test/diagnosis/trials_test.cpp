#include "bodyschema/diagnosis/trials.hpp"

#include <gtest/gtest.h>

#include "diagnosis/trial_robot.hpp"

namespace bodyschema {
namespace {

TEST(Trials, AFewOfEveryRowGoWell) {
  const auto outcomes = run_diagnosis_trials(test::robot(), 9, test::seed(), 2);
  const auto r = rates(outcomes);
  EXPECT_EQ(r.single_trials, 9u);
  EXPECT_EQ(r.null_trials, 6u);
  // At the demanded rates fewer than one run in a thousand fails; a guess fails nearly always.
  EXPECT_LE(r.null_false_alarm, 2.0 / 6.0);
  EXPECT_GE(r.single_in_class, 6.0 / 9.0);
  EXPECT_LE(r.single_wrong, 2.0 / 9.0);
  for (const auto& o : outcomes) {
    if (o.setting != "single") continue;
    EXPECT_TRUE(in_class(o.report, o.truth[0]) || o.report.causes.empty())
        << o.truth[0].cause.text() << " " << o.truth[0].value << ", seed " << o.seed << ": "
        << o.report.sentence;
  }
}

TEST(Trials, DoNotDependOnThreads) {
  const auto one = run_diagnosis_trials(test::robot(), 1, 3, 1);
  const auto two = run_diagnosis_trials(test::robot(), 1, 3, 2);
  ASSERT_EQ(one.size(), two.size());
  for (std::size_t i = 0; i < one.size(); ++i) {
    EXPECT_EQ(one[i].report.sentence, two[i].report.sentence);
    EXPECT_EQ(one[i].report.after.rms_px, two[i].report.after.rms_px);
  }
}

}  // namespace
}  // namespace bodyschema
