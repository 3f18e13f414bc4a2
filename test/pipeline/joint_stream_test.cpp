#include "bodyschema/pipeline/joint_stream.hpp"

#include <gtest/gtest.h>

#include <filesystem>

#include "bodyschema/core/configuration.hpp"
#include "bodyschema/observation/joint_motion.hpp"

namespace bodyschema {
namespace {

constexpr Microseconds kPeriod = 10'000;

struct Robot {
  Configuration configuration =
      Configuration::load(std::filesystem::path(BODYSCHEMA_SOURCE_DIR) / "config/icub_right/estimator.yaml");
  RobotSetup setup = RobotSetup::from(configuration.section("robot"));
  std::shared_ptr<const RobotModel> model = setup.load();
  JointStream stream{*model, setup, BusOptions::from(configuration.section("bus"))};
};

std::vector<std::uint8_t> reading(const std::string& joint, Microseconds utime, double q) {
  bot_core::joint_state_t message;
  message.utime = utime;
  message.num_joints = 1;
  message.joint_name = {joint};
  message.joint_position = {static_cast<float>(q)};
  message.joint_velocity = {0.0F};
  message.joint_effort = {0.0F};
  return encode(message);
}

/// The samples of an elbow that is read with these stamps.
std::vector<JointSample> samples_of(const std::vector<Microseconds>& stamps) {
  Robot robot;
  for (const auto utime : stamps) robot.stream.take(reading("r_elbow", utime, 0.5));
  return robot.stream.finish();
}

/// `count` stamps from `begin` on.
std::vector<Microseconds> steady(Microseconds begin, int count) {
  std::vector<Microseconds> stamps;
  for (int i = 0; i < count; ++i) stamps.push_back(begin + i * kPeriod);
  return stamps;
}

void expect_in_order(const std::vector<JointSample>& samples) {
  for (std::size_t i = 1; i < samples.size(); ++i) EXPECT_LT(samples[i - 1].utime, samples[i].utime) << i;
}

TEST(JointStream, LosesLittleToAStampFarInTheFuture) {
  auto stamps = steady(1'000'000, 200);
  stamps[100] = 5'000'000'000;
  const auto samples = samples_of(stamps);
  EXPECT_GE(samples.size(), 195u);
  EXPECT_EQ(samples.back().utime, stamps.back());
  expect_in_order(samples);
}

TEST(JointStream, BeginsAnewWhereTheClockStepsBack) {
  auto stamps = steady(100'000'000, 1000);
  const auto again = steady(105'000'000, 1000);
  stamps.insert(stamps.end(), again.begin(), again.end());
  const auto samples = samples_of(stamps);
  EXPECT_EQ(samples.back().utime, again.back());
  EXPECT_GE(samples.size(), 1490u);
  expect_in_order(samples);
}

TEST(JointStream, AnOldStrayIsLeftOut) {
  auto stamps = steady(100'000'000, 200);
  stamps[50] = stamps[51] = 1'000'000;
  const auto samples = samples_of(stamps);
  EXPECT_EQ(samples.size(), 198u);
  expect_in_order(samples);
}

TEST(JointStream, LosesLittleToAStampFarInTheFutureOfAnotherJoint) {
  Robot robot;
  const auto stamps = steady(1'000'000, 200);
  for (std::size_t i = 0; i < stamps.size(); ++i) {
    robot.stream.take(reading("r_elbow", stamps[i], 0.5));
    if (i == 100) robot.stream.take(reading("neck_pitch", 5'000'000'000, 0.1));
  }
  const auto samples = robot.stream.finish();
  EXPECT_GE(samples.size(), 195u);
  EXPECT_EQ(samples.back().utime, stamps.back());
  expect_in_order(samples);
}

/// At 50 Hz each, 150 deg/s are 3 deg between two readings of the arm; the neck's come in between, and an eye has
/// stopped coming.
TEST(JointStream, AQuickArmMovesWhileTheHeadIsRead) {
  constexpr double kSpeed = 2.6;  // rad/s
  for (const Microseconds after_head : {-3'000, 1'000, 7'000, 10'000, 19'000}) {
    Robot robot;
    robot.stream.take(reading("eyes_tilt", 0, 0.2));
    for (Microseconds t = 1'000'000; t < 2'000'000; t += 20'000) {
      robot.stream.take(reading("neck_pitch", t, 0.1));
      robot.stream.take(reading("r_elbow", t + after_head, kSpeed * seconds(t + after_head - 1'000'000)));
    }
    const auto samples = robot.stream.finish();
    const auto elbow = robot.model->joint_index("r_elbow"), tilt = robot.model->joint_index("eyes_tilt");
    Eigen::VectorXd qdot, qddot;
    for (Microseconds t = 1'100'000; t < 1'900'000; t += 7'000) {
      joint_motion(samples, t, qdot, qddot);
      EXPECT_NEAR(qdot[elbow], kSpeed, 0.01 * kSpeed) << after_head << " us after the head's reading";
      EXPECT_EQ(qdot[tilt], 0.0);
    }
    EXPECT_FLOAT_EQ(static_cast<float>(samples.back().q[tilt]), 0.2F);
  }
}

}  // namespace
}  // namespace bodyschema
