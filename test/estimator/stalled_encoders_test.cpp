#include "stalled_encoders.hpp"

#include <gtest/gtest.h>

#include "bodyschema/geometry/pose.hpp"

namespace bodyschema {
namespace {

/// Two joints; which of them the pictures showed to have stepped in a frame, and by how much. A frame is a second.
class TwoJoints : public ::testing::Test {
 protected:
  std::vector<StalledEncoders::Resumed> look(double reading_0_deg, double reading_1_deg) {
    return encoders_.look(Eigen::Vector2d(radians(reading_0_deg), radians(reading_1_deg)), time_s_ += 1.0);
  }
  void stepped(Eigen::Index joint, double step_deg) {
    offset_deg_[joint] += step_deg;
    encoders_.stepped(joint, radians(step_deg), radians(offset_deg_[joint]), time_s_);
  }
  /// Both as the frame shows them.
  void seen(double offset_0_deg, double offset_1_deg, double sd_deg = 0.1) {
    encoders_.seen(Eigen::Vector2d(radians(offset_0_deg), radians(offset_1_deg)),
                   Eigen::Vector2d::Constant(radians(sd_deg)));
  }
  StalledEncoders encoders_{2};
  Eigen::Vector2d offset_deg_ = Eigen::Vector2d::Zero();
  double time_s_ = 0.0;
};

TEST_F(TwoJoints, AJointThatGoesOnUnderAReadingThatStandsStalls) {
  EXPECT_TRUE(look(30.0, 0.0).empty());
  stepped(0, 1.5);
  EXPECT_EQ(encoders_.joint(), -1);
  for (const double offset_deg : {1.5, 2.5, 3.4}) {
    look(30.0, offset_deg);
    seen(offset_deg, 0.0);
    EXPECT_EQ(encoders_.joint(), -1) << offset_deg;
  }
  look(30.0, 4.0);
  seen(4.5, 0.0);
  EXPECT_EQ(encoders_.joint(), 0);
  // The step, and what it went on by beyond four standard deviations of what pictures see.
  EXPECT_NEAR(encoders_.moved_rad(), radians(1.5 + 3.0 - 0.4), 1e-12);
  EXPECT_EQ(encoders_.suspects(), std::vector<Eigen::Index>{0});
}

TEST_F(TwoJoints, WhatPicturesHardlySeeIsNoMotion) {
  look(30.0, 10.0);
  stepped(0, 1.5);
  for (int frame = 0; frame < 20; ++frame) {
    look(30.0, 10.0);
    seen(frame % 2 == 0 ? 5.0 : -2.0, 0.0, 1.2);
  }
  EXPECT_EQ(encoders_.joint(), -1);
}

TEST_F(TwoJoints, StepAfterStepUnderAReadingThatStandsIsAStallToo) {
  for (int frame = 0; frame < 4; ++frame) {
    EXPECT_EQ(encoders_.joint(), -1) << frame;
    EXPECT_TRUE(look(30.0, frame).empty());
    stepped(0, frame % 2 == 0 ? 0.6 : -0.6);
  }
  EXPECT_EQ(encoders_.joint(), 0) << "to and fro is added up";
  EXPECT_NEAR(encoders_.moved_rad(), radians(2.4), 1e-12);
}

TEST_F(TwoJoints, OneStepIsASlipAndSuspicionEndsWhenTheReadingMoves) {
  look(30.0, 10.0);
  stepped(0, 8.0);
  const double stepped_s = time_s_;
  for (int frame = 0; frame < 100; ++frame) {
    EXPECT_TRUE(look(30.0, 10.0).empty());
    seen(8.0 + 0.1 * (frame % 3), 0.0);
  }
  EXPECT_EQ(encoders_.joint(), -1);
  EXPECT_TRUE(encoders_.suspected()) << "it could be the beginning of a stall";
  const auto again = look(31.0, 10.0);
  ASSERT_EQ(again.size(), 1u);
  EXPECT_EQ(again[0].joint, 0);
  EXPECT_FALSE(again[0].went_on) << "what the slip taught holds";
  EXPECT_EQ(again[0].stepped_s, stepped_s);
  EXPECT_FALSE(encoders_.suspected());
}

TEST_F(TwoJoints, StepsTooSmallToBeAMotionAreNone) {
  look(30.0, 10.0);
  for (int i = 0; i < 4; ++i) stepped(0, 0.4);
  EXPECT_EQ(encoders_.joint(), -1);
  EXPECT_EQ(encoders_.moved_rad(), 0.0);
}

/// Alive again: what was learned of the joint meanwhile is to be forgotten, and of that joint alone.
TEST_F(TwoJoints, AStallEndsWithTheFirstReadingThatMoves) {
  look(30.0, 10.0);
  stepped(0, 2.0);
  seen(7.0, 0.0);
  EXPECT_EQ(encoders_.joint(), 0);
  const auto again = look(31.0, 10.0);
  ASSERT_EQ(again.size(), 1u);
  EXPECT_EQ(again[0].joint, 0);
  EXPECT_TRUE(again[0].went_on);
  EXPECT_EQ(encoders_.joint(), -1);
  EXPECT_EQ(encoders_.moved_rad(), 0.0);
  EXPECT_FALSE(encoders_.suspected());
  EXPECT_TRUE(look(32.0, 11.0).empty()) << "once";
}

TEST_F(TwoJoints, AReadingThatFlickersStands) {
  look(30.0, 10.0);
  const double since_s = time_s_;
  for (int frame = 0; frame < 6; ++frame) EXPECT_TRUE(look(30.0 + 0.08 * (frame % 2), 10.0 + frame).empty());
  EXPECT_EQ(encoders_.standing_since_s(0), since_s);
  EXPECT_EQ(encoders_.standing_since_s(1), time_s_);
}

TEST_F(TwoJoints, StepsWhileReadingsMoveAreNoStall) {
  for (int frame = 0; frame < 20; ++frame) {
    look(30.0 + frame, 10.0);
    stepped(0, 3.0);
  }
  EXPECT_EQ(encoders_.joint(), -1);
}

TEST_F(TwoJoints, TheJointSeenToMoveMostIsNamed) {
  look(30.0, 10.0);
  for (int i = 0; i < 4; ++i) {
    stepped(0, 1.0);
    stepped(1, 2.5);
  }
  EXPECT_EQ(encoders_.joint(), 1);
  EXPECT_NEAR(encoders_.moved_rad(), radians(10.0), 1e-12);
}

TEST_F(TwoJoints, OnlyAReadingThatStandsStandsWhileOthersMove) {
  look(0.0, 0.0);
  for (int frame = 1; frame < 4; ++frame) {
    look(frame, -frame);
    EXPECT_TRUE(encoders_.standing_while_others_move().empty()) << "both move";
  }
  look(4.0, -3.0);
  EXPECT_EQ(encoders_.standing_while_others_move(), std::vector<Eigen::Index>{1});
  look(4.0, -4.0);
  EXPECT_EQ(encoders_.standing_while_others_move(), std::vector<Eigen::Index>{0});
}

}  // namespace
}  // namespace bodyschema
