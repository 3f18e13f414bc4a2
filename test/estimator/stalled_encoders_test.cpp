#include "stalled_encoders.hpp"

#include <gtest/gtest.h>

#include "bodyschema/geometry/pose.hpp"

namespace bodyschema {
namespace {

/// Two joints; which of them the pictures showed to have stepped in a frame, and by how much.
class TwoJoints : public ::testing::Test {
 protected:
  std::vector<Eigen::Index> look(double reading_0_deg, double reading_1_deg) {
    return encoders_.look(Eigen::Vector2d(radians(reading_0_deg), radians(reading_1_deg)));
  }
  void stepped(Eigen::Index joint, double step_deg) { encoders_.stepped(joint, radians(step_deg)); }
  StalledEncoders encoders_{2};
};

TEST_F(TwoJoints, StepAfterStepUnderAReadingThatStandsIsAStall) {
  for (int frame = 0; frame < 3; ++frame) {
    EXPECT_EQ(encoders_.joint(), -1) << frame;
    EXPECT_TRUE(look(30.0, frame).empty());
    stepped(0, 1.5);
  }
  EXPECT_EQ(encoders_.joint(), 0);
  EXPECT_NEAR(encoders_.moved_rad(), radians(4.5), 1e-12);
  EXPECT_TRUE(encoders_.suspected());
}

TEST_F(TwoJoints, ToAndFroIsAddedUp) {
  for (int frame = 0; frame < 4; ++frame) {
    look(30.0, 10.0);
    stepped(0, frame % 2 == 0 ? 1.0 : -1.0);
  }
  EXPECT_EQ(encoders_.joint(), 0);
  EXPECT_NEAR(encoders_.moved_rad(), radians(4.0), 1e-12);
}

TEST_F(TwoJoints, OneStepIsASlipAndSuspicionEndsWhenTheReadingMoves) {
  look(30.0, 10.0);
  stepped(0, 8.0);
  for (int frame = 0; frame < 100; ++frame) EXPECT_TRUE(look(30.0, 10.0).empty());
  EXPECT_EQ(encoders_.joint(), -1);
  EXPECT_TRUE(encoders_.suspected()) << "it could be the beginning of a stall";
  EXPECT_TRUE(look(31.0, 10.0).empty()) << "what a slip taught holds";
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
  for (int i = 0; i < 5; ++i) stepped(0, 2.0);
  EXPECT_EQ(encoders_.joint(), 0);
  EXPECT_EQ(look(31.0, 10.0), std::vector<Eigen::Index>{0});
  EXPECT_EQ(encoders_.joint(), -1);
  EXPECT_EQ(encoders_.moved_rad(), 0.0);
  EXPECT_FALSE(encoders_.suspected());
  EXPECT_TRUE(look(32.0, 11.0).empty()) << "once";
}

TEST_F(TwoJoints, AReadingThatFlickersStands) {
  for (int frame = 0; frame < 6; ++frame) {
    EXPECT_TRUE(look(30.0 + 0.08 * (frame % 2), 10.0).empty());
    stepped(0, 1.0);
  }
  EXPECT_EQ(encoders_.joint(), 0);
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

}  // namespace
}  // namespace bodyschema
