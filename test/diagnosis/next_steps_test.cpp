#include "next_steps.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace bodyschema::diagnosis {
namespace {

using ::testing::AllOf;
using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

TEST(NextSteps, AreCommandsWithTheConfigurationThatWasGiven) {
  LogDiagnosisOptions options;
  options.log = "babble.log";
  options.out = "out";
  options.configuration = "my_arm/estimator.yaml";
  for (const char* verdict : {"none", "unexplained", "named", "class"}) {
    const auto steps = next_steps(verdict, options, false);
    ASSERT_FALSE(steps.empty()) << verdict;
    EXPECT_THAT(steps, Each(AllOf(HasSubstr("--config my_arm/estimator.yaml"), Not(HasSubstr("CONFIG"))))) << verdict;
  }
  EXPECT_THAT(next_steps("named", options, true),
              ElementsAre("See on a second log whether it holds: bodyschema diagnose babble.log SECOND.log --config "
                          "my_arm/estimator.yaml --out out_both",
                          "Apply it: bodyschema replay babble.log --config my_arm/estimator.yaml --extended-model "
                          "out/extended_model.yaml --out out/replay, then bodyschema export out/replay/summary.json "
                          "--config my_arm/estimator.yaml --extended-model out/extended_model.yaml --out out/apply",
                          HasSubstr("record the motion in out/motion.csv")));
  options.configuration.clear();
  EXPECT_THAT(next_steps("none", options, false),
              ElementsAre(HasSubstr("babble.log --config CONFIG --out out/replay")));
}

}  // namespace
}  // namespace bodyschema::diagnosis
