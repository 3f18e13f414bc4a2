#include "bodyschema/effects/encoder_track.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "bodyschema/core/configuration.hpp"
#include "bodyschema/geometry/pose.hpp"
#include "bodyschema/robot/gravity_torques.hpp"

namespace bodyschema {
namespace {

/// This project's own robot without its meshes; the elbow swings, everything else stands.
class EncoderTrackTest : public testing::Test {
 protected:
  EncoderTrackTest() {
    const Configuration configuration =
        Configuration::load(std::string(BODYSCHEMA_SOURCE_DIR) + "/config/icub_right/robot.yaml");
    setup = RobotSetup::from(configuration.section("robot"));
    setup.model.rendered_links.clear();
    robot = setup.load();
    elbow = robot->joint_index("r_elbow");
    none = Eigen::VectorXd::Zero(robot->joint_count());
  }
  [[nodiscard]] JointSample sample(Microseconds utime) const {
    JointSample s;
    s.utime = utime;
    s.q = setup.default_joints(*robot);
    s.qdot.setZero(s.q.size());  // as drivers publish
    s.q[elbow] = radians(60.0 + 10.0 * std::sin(kPi * seconds(utime)));
    return s;
  }
  [[nodiscard]] std::vector<JointSample> samples(Microseconds from, Microseconds to) const {
    std::vector<JointSample> list;
    for (Microseconds t = from; t <= to; t += 10'000) list.push_back(sample(t));
    return list;
  }
  [[nodiscard]] double speed(Microseconds utime) const { return radians(10.0) * kPi * std::cos(kPi * seconds(utime)); }

  RobotSetup setup;
  std::shared_ptr<const RobotModel> robot;
  Eigen::Index elbow = 0;
  Eigen::VectorXd none;
};

TEST_F(EncoderTrackTest, EverySampleIsShownOnceInOrderAndNoneAheadOfTheExposure) {
  EncoderTrack track(robot, setup);
  std::vector<Microseconds> seen;
  const auto show = [&](const JointSample& s) { seen.push_back(s.utime); };
  // 20 s at 100 Hz, far more than are kept; samples come 0.3 s ahead of exposures.
  Microseconds given = 0;
  for (Microseconds now = 0; now <= 20'000'000; now += 33'000) {
    track.add(samples(given, now + 300'000));
    given = (now + 300'000) / 10'000 * 10'000 + 10'000;
    track.advance(now, show);
    ASSERT_FALSE(seen.empty());
    ASSERT_LE(seen.back(), now);
    ASSERT_GT(seen.back() + 10'000, now);
  }
  for (std::size_t i = 0; i < seen.size(); ++i) ASSERT_EQ(seen[i], static_cast<Microseconds>(i) * 10'000);
}

TEST_F(EncoderTrackTest, TheMotionIsThatOfTheSamplesWhateverWasPublishedAlsoAfterALongTime) {
  EncoderTrack track(robot, setup);
  Microseconds given = 0;
  for (Microseconds now = 0; now <= 20'000'000; now += 500'000) {
    track.add(samples(given, now + 200'000));
    given = now + 210'000;
    track.advance(now, [](const JointSample&) {});
    Instant at;
    track.instant(sample(now), 1, none, at);
    EXPECT_EQ(at.camera, 1u);
    EXPECT_NEAR(at.qdot[elbow], speed(now), now == 0 ? 0.05 : 0.01) << now;
  }
}

TEST_F(EncoderTrackTest, ASampleWithTheStampOfTheLastReplacesIt) {
  EncoderTrack track(robot, setup);
  auto head = sample(0), arm = sample(0);
  head.q[elbow] = 0.0;
  track.add(std::vector{head});
  track.add(std::vector{arm});
  std::vector<double> shown;
  track.advance(0, [&](const JointSample& s) { shown.push_back(s.q[elbow]); });
  EXPECT_EQ(shown, std::vector{arm.q[elbow]});
}

// Between two samples of one stamp velocities were infinite, or not a number.
TEST_F(EncoderTrackTest, ASampleThatComesAgainIsShownAgainAndIsNoMotion) {
  EncoderTrack track(robot, setup);
  int shown = 0;
  for (int again = 0; again < 2; ++again) {
    track.add(std::vector{sample(0)});
    track.advance(0, [&](const JointSample&) { ++shown; });
  }
  EXPECT_EQ(shown, 2);
  Instant at;
  track.instant(sample(0), 0, none, at);
  EXPECT_EQ(at.qdot, none);
}

TEST_F(EncoderTrackTest, WhatIsForgottenIsNotShown) {
  EncoderTrack track(robot, setup);
  track.add(samples(0, 1'000'000));
  track.forget();
  track.advance(2'000'000, [](const JointSample&) { ADD_FAILURE(); });
  Instant at;
  track.instant(sample(500'000), 0, none, at);
  EXPECT_EQ(at.qdot[elbow], 0.0);
}

TEST_F(EncoderTrackTest, TorquesAreThoseWhereTheArmStands) {
  ASSERT_TRUE(robot->has_masses());
  EncoderTrack track(robot, setup);
  Eigen::VectorXd offsets = none;
  offsets[elbow] = radians(5.0);
  Instant at;
  track.instant(sample(0), 0, offsets, at);
  GravityTorques torques(robot);
  EXPECT_LT((at.gravity_torque - torques.compute(sample(0).q - offsets, setup.gravity_W)).norm(), 1e-12);
  EXPECT_EQ(at.encoder, sample(0).q);
  const Eigen::VectorXd q = at.q;
  track.torques_at(sample(0), 3.0 * offsets, at);
  EXPECT_LT((at.gravity_torque - torques.compute(sample(0).q - 3.0 * offsets, setup.gravity_W)).norm(), 1e-12);
  EXPECT_EQ(at.q, q) << "the torques alone";
}

}  // namespace
}  // namespace bodyschema
