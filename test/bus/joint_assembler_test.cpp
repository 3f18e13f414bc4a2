#include "bodyschema/bus/joint_assembler.hpp"

#include <gtest/gtest.h>

namespace bodyschema {
namespace {

constexpr Microseconds kClockStep = 1'000'000;

JointStateMessage message(Microseconds utime, std::vector<std::string> names, std::vector<float> q) {
  JointStateMessage m;
  m.utime = utime;
  m.velocity_rad_s.assign(names.size(), 0.0F);
  m.names = std::move(names);
  m.position_rad = std::move(q);
  return m;
}

TEST(JointAssembler, JointsOfWhichNothingCameRest) {
  JointAssembler assembler({"arm", "neck"}, {{"neck", 0.25}, {"leg", 1.0}}, kClockStep);
  const JointSample* sample = assembler.take(message(10, {"arm", "leg"}, {0.5F, 9.0F}));
  ASSERT_NE(sample, nullptr);
  EXPECT_EQ(sample->utime, 10);
  EXPECT_EQ(sample->q, Eigen::Vector2d(0.5, 0.25));
}

TEST(JointAssembler, HeadAndArmWithOneStampAreBothKept) {
  JointAssembler assembler({"arm", "neck"}, {}, kClockStep);
  for (Microseconds t = 10; t <= 30; t += 10) {
    const auto q = static_cast<float>(t);
    ASSERT_NE(assembler.take(message(t, {"neck"}, {q})), nullptr);
    const JointSample* sample = assembler.take(message(t, {"arm"}, {q}));
    ASSERT_NE(sample, nullptr);
    EXPECT_EQ(sample->utime, t);
    EXPECT_EQ(sample->q, Eigen::Vector2d(static_cast<double>(t), static_cast<double>(t)));
  }
}

TEST(JointAssembler, WhatIsOlderOrForeignChangesNothing) {
  JointAssembler assembler({"arm", "neck"}, {}, kClockStep);
  ASSERT_NE(assembler.take(message(20, {"arm"}, {2.0F})), nullptr);
  EXPECT_EQ(assembler.take(message(10, {"arm"}, {1.0F})), nullptr);
  EXPECT_EQ(assembler.take(message(30, {"leg"}, {3.0F})), nullptr);
  EXPECT_EQ(assembler.take(message(40, {"neck"}, {4.0F}))->q, Eigen::Vector2d(2.0, 4.0));
  assembler.forget();
  EXPECT_NE(assembler.take(message(10, {"arm"}, {1.0F})), nullptr);
}

TEST(JointAssembler, AnArmThatTrailsTheHeadCountsAtTheHeadsStamp) {
  JointAssembler assembler({"arm", "neck"}, {}, kClockStep);
  for (Microseconds t = 10; t <= 30; t += 10) {
    const auto q = static_cast<float>(t);
    ASSERT_NE(assembler.take(message(t, {"neck"}, {q})), nullptr);
    const JointSample* sample = assembler.take(message(t - 3, {"arm"}, {-q}));
    ASSERT_NE(sample, nullptr);
    EXPECT_EQ(sample->utime, t);
    EXPECT_EQ(sample->q, Eigen::Vector2d(-static_cast<double>(t), static_cast<double>(t)));
    EXPECT_EQ(assembler.take(message(t - 4, {"arm"}, {0.0F})), nullptr) << "older than the arm's own";
  }
}

TEST(JointAssembler, AStampFarAheadOfASilentSenderHidesTheOthersForTwoMessagesOnly) {
  JointAssembler assembler({"arm", "leg"}, {}, kClockStep);
  ASSERT_NE(assembler.take(message(10, {"arm"}, {1.0F})), nullptr);
  ASSERT_NE(assembler.take(message(3'600'000'000, {"leg"}, {9.0F})), nullptr);
  EXPECT_EQ(assembler.take(message(20, {"arm"}, {2.0F})), nullptr);
  EXPECT_EQ(assembler.take(message(30, {"arm"}, {3.0F})), nullptr);
  for (Microseconds t = 40; t <= 60; t += 10) {
    const JointSample* sample = assembler.take(message(t, {"arm"}, {4.0F}));
    ASSERT_NE(sample, nullptr);
    EXPECT_EQ(sample->utime, t);
    EXPECT_EQ(sample->q, Eigen::Vector2d(4.0, 9.0));
  }
}

/// The other arm's board publishes as often as ours, ten seconds ahead for good.
TEST(JointAssembler, TheClockOfAnIdleJointThatStaysAheadHoldsUpNobody) {
  JointAssembler assembler({"arm", "leg"}, {{"leg", 0.5}}, kClockStep, {"leg"});
  for (Microseconds t = 10; t <= 60; t += 10) {
    EXPECT_EQ(assembler.take(message(10'000'000 + t, {"leg"}, {9.0F})), nullptr);
    const JointSample* sample = assembler.take(message(t, {"arm"}, {4.0F}));
    ASSERT_NE(sample, nullptr);
    EXPECT_EQ(sample->utime, t);
    EXPECT_EQ(sample->q, Eigen::Vector2d(4.0, 0.5));
  }
}

}  // namespace
}  // namespace bodyschema
