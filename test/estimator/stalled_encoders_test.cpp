#include "bodyschema/estimator/stalled_encoders.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "bodyschema/geometry/pose.hpp"

namespace bodyschema {
namespace {

/// Two joints, both known to 0.1 deg.
class TwoJoints : public ::testing::Test {
 protected:
  void look(double reading_0_deg, double offset_0_deg, double reading_1_deg = 10.0, double offset_1_deg = 2.0,
            bool fits = true, bool settled = true, bool remembers = true) {
    const Eigen::Vector2d reading(radians(reading_0_deg), radians(reading_1_deg));
    const Eigen::Vector2d offset(radians(offset_0_deg), radians(offset_1_deg));
    encoders_.look(time_s_ += 1.0 / 30.0, reading, offset, Eigen::Vector2d::Constant(radians(0.1)), fits, settled,
                   remembers);
  }
  StalledEncoders encoders_{2};
  double time_s_ = 0.0;
};

TEST_F(TwoJoints, AReadingThatStandsWhileTheJointMovesIsAStall) {
  double moving = 0.0;
  int frame = 0;
  for (; frame < 60 && encoders_.joint() < 0; ++frame) look(30.0, moving -= 0.5, 10.0 + frame);
  EXPECT_EQ(encoders_.joint(), 0);
  EXPECT_LT(frame, 20);
  EXPECT_GE(encoders_.moved_rad(), radians(4.5));
  // Alive again.
  look(31.0, moving, 10.0 + frame);
  EXPECT_EQ(encoders_.joint(), -1);
  EXPECT_EQ(encoders_.moved_rad(), 0.0);
}

TEST_F(TwoJoints, ToAndFroIsAStallToo) {
  for (int frame = 0; frame < 90; ++frame) look(30.0, 4.0 * std::sin(0.2 * frame), 10.0 + frame);
  EXPECT_EQ(encoders_.joint(), 0);
}

TEST_F(TwoJoints, AJointHeldStillIsNone) {
  for (int frame = 0; frame < 300; ++frame) look(30.0, 3.0 + 0.3 * std::sin(frame), 10.0 + frame);
  EXPECT_EQ(encoders_.joint(), -1);
}

TEST_F(TwoJoints, ASlipWhileHeldStillIsNone) {
  for (int frame = 0; frame < 50; ++frame) look(30.0, 3.0);
  EXPECT_FALSE(encoders_.doubtful());
  for (int frame = 0; frame < 10; ++frame) look(30.0, -5.0);
  EXPECT_TRUE(encoders_.doubtful()) << "for a second it could be the beginning of a stall";
  for (int frame = 0; frame < 40; ++frame) look(30.0, -5.0);
  EXPECT_FALSE(encoders_.doubtful());
  EXPECT_EQ(encoders_.joint(), -1);
}

TEST_F(TwoJoints, OneStrayFrameNowAndThenIsNone) {
  for (int frame = 0; frame < 300; ++frame) look(30.0, frame % 5 == 0 ? 9.0 : 3.0);
  EXPECT_EQ(encoders_.joint(), -1);
}

TEST_F(TwoJoints, OffsetsThatExplainNothingSayNothing) {
  for (int frame = 0; frame < 100; ++frame) look(30.0, 2.0 * frame, 10.0, 2.0, false);
  EXPECT_EQ(encoders_.joint(), -1);
}

TEST_F(TwoJoints, TheDriftOfTheLastSecondIsTold) {
  for (int frame = 0; frame < 100; ++frame) look(30.0 + 0.01 * (frame % 2), 0.1 * frame, 10.0 + frame, 0.1 * frame);
  EXPECT_NEAR(encoders_.drift_rad()(0), radians(2.9), 1e-9);
  EXPECT_EQ(encoders_.drift_rad()(1), 0.0) << "its encoder lives";
  look(30.0, 0.0, 10.0, 0.0, true, false);
  EXPECT_EQ(encoders_.drift_rad()(0), 0.0) << "a new search begins anew";
}

// At 15 deg/s, in the middle of a motion: until the pictures would have shown that the joint goes on.
TEST_F(TwoJoints, AReadingThatStopsDeadIsDoubtedUntilThePicturesWouldHaveContradictedIt) {
  double reading_deg = 30.0;
  for (int frame = 0; frame < 10; ++frame) look(reading_deg += 0.5, 2.0);
  EXPECT_EQ(encoders_.drift_rad()(0), 0.0);
  for (int frame = 1; frame <= 5; ++frame) {
    look(reading_deg, 2.0);
    EXPECT_NEAR(encoders_.drift_rad()(0), radians(0.5 * frame), radians(0.11)) << frame;
    EXPECT_EQ(encoders_.drift_rad()(1), 0.0) << "has always stood";
  }
  for (int frame = 0; frame < 10; ++frame) look(reading_deg, 2.0);
  EXPECT_EQ(encoders_.drift_rad()(0), 0.0);
}

TEST_F(TwoJoints, AMotionThatSlowsDownIsNotDoubtedWhenItEnds) {
  for (int frame = 0; frame <= 60; ++frame) {
    look(20.0 * std::cos(kPi * std::min(frame, 30) / 30.0), 2.0);
    EXPECT_LT(encoders_.drift_rad()(0), radians(0.1)) << frame;
  }
}

TEST_F(TwoJoints, AReadingThatFlickersDoesNotMove) {
  std::mt19937 random(1);
  std::normal_distribution<double> noise_deg(0.0, 0.08);
  for (int frame = 0; frame < 3000; ++frame) {
    look(30.0 + noise_deg(random), 2.0, 10.0 + (frame / 3 % 2 == 0 ? 0.0 : 0.15));
    EXPECT_LT(encoders_.drift_rad().maxCoeff(), radians(0.01)) << frame;
  }
}

TEST_F(TwoJoints, AMemoryDroppedWhileAReadingStandsIsToldForASecond) {
  const auto frames = [&](int n, bool remembers, bool stands) {
    for (int i = 0; i < n; ++i) {
      look(stands ? 30.0 : 30.0 + i % 2, 3.0, 10.0 + i % 2, 2.0, true, remembers, remembers);
    }
  };
  frames(20, false, true);
  EXPECT_FALSE(encoders_.dropped_while_standing()) << "there was none yet";
  frames(20, true, true);
  EXPECT_FALSE(encoders_.dropped_while_standing());
  frames(3, false, true);
  EXPECT_TRUE(encoders_.dropped_while_standing());
  frames(29, true, true);
  EXPECT_TRUE(encoders_.dropped_while_standing());
  frames(2, true, true);
  EXPECT_FALSE(encoders_.dropped_while_standing());
  frames(20, true, false);
  frames(3, false, false);
  frames(10, true, false);
  EXPECT_FALSE(encoders_.dropped_while_standing()) << "all encoders live";
}

TEST_F(TwoJoints, TheJointSeenToMoveMostIsNamed) {
  for (int frame = 0; frame < 100; ++frame) look(30.0, 0.2 * frame, 10.0, 0.5 * frame);
  EXPECT_EQ(encoders_.joint(), 1);
}

}  // namespace
}  // namespace bodyschema
