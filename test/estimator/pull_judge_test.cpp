#include "bodyschema/estimator/pull_judge.hpp"

#include <gtest/gtest.h>

namespace bodyschema {
namespace {

using Verdict = PullJudge::Verdict;

TEST(PullJudge, OneStrayIsDoubtedTwoContradict) {
  PullJudge judge;
  for (int i = 0; i < 20; ++i) ASSERT_EQ(judge.judge(3.0), Verdict::kAgrees);
  EXPECT_EQ(judge.judge(150.0), Verdict::kDoubtful);
  EXPECT_TRUE(judge.doubting());
  EXPECT_EQ(judge.judge(3.0), Verdict::kAgrees);
  EXPECT_FALSE(judge.doubting());
  EXPECT_EQ(judge.judge(150.0), Verdict::kDoubtful);
  EXPECT_EQ(judge.judge(150.0), Verdict::kContradicts);
}

TEST(PullJudge, AHugePullContradictsAtOnce) {
  PullJudge judge;
  EXPECT_EQ(judge.judge(1000.0), Verdict::kContradicts);
}

// A robot whose model is wrong pulls in every frame: that is no slip.
TEST(PullJudge, WhatIsUsualIsNotDoubted) {
  PullJudge judge;
  for (double pull = 5.0; pull < 150.0; pull *= 1.05) EXPECT_EQ(judge.judge(pull), Verdict::kAgrees) << pull;
  EXPECT_EQ(judge.judge(150.0), Verdict::kAgrees);
  judge.forget();
  EXPECT_EQ(judge.judge(150.0), Verdict::kDoubtful);
}

}  // namespace
}  // namespace bodyschema
