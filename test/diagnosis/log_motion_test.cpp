#include "log_motion.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "outline/own_robot.hpp"

namespace bodyschema::diagnosis {
namespace {

using testing::HasSubstr;
using testing::Not;

const NotTestable* find(const std::vector<NotTestable>& list, const CauseName& cause) {
  const auto at = std::find_if(list.begin(), list.end(), [&](const auto& n) { return n.cause == cause; });
  return at == list.end() ? nullptr : &*at;
}

/// Our own robot, whose elbow goes as a test says; nothing else moves.
class Motion : public OwnRobot {
 protected:
  Motion() : roles_(JointRoles::of(robot_, setup_, rig_)), elbow_(robot_->joint_index("r_elbow")) {}

  /// @param angle  of the elbow, rad, at a time in seconds
  [[nodiscard]] std::vector<JointSample> moving(double rate_hz, const std::function<double(double)>& angle,
                                                double length_s = 12.0) const {
    std::vector<JointSample> list;
    for (int i = 0; i < static_cast<int>(rate_hz * length_s); ++i) {
      const double t = i / rate_hz;
      JointSample sample{1'000'000 + microseconds(t), pose(0.5), Eigen::VectorXd::Zero(robot_->joint_count())};
      sample.q[elbow_] = angle(t);
      sample.qdot[elbow_] = (angle(t + 1e-3) - angle(t - 1e-3)) / 2e-3;
      list.push_back(std::move(sample));
    }
    return list;
  }
  [[nodiscard]] static double swinging(double t) { return 1.2 + 0.35 * std::sin(1.57 * t); }

  [[nodiscard]] LogMotion motion(const std::vector<JointSample>& encoders, std::size_t cameras = 2) const {
    return log_motion(encoders, cameras, encoders, robot_, setup_, roles_);
  }
  [[nodiscard]] int reversals(const std::function<double(double)>& angle) const {
    return motion(moving(100.0, angle)).reversals[static_cast<std::size_t>(elbow_)];
  }
  [[nodiscard]] std::vector<NotTestable> refused(const std::vector<JointSample>& encoders,
                                                 std::size_t cameras = 2) const {
    return untestable(roles_, motion(encoders, cameras));
  }

  JointRoles roles_;
  Eigen::Index elbow_;
};

TEST_F(Motion, IsThatOfTheJoints) {
  const auto encoders = moving(100.0, swinging);
  const auto seen = motion(encoders);
  EXPECT_EQ(seen.cameras, 2u);
  EXPECT_TRUE(seen.has_masses);
  EXPECT_NEAR(seen.range_rad[elbow_], 0.7, 0.01);
  EXPECT_EQ(seen.range_rad[robot_->joint_index("r_wrist_yaw")], 0.0);
  EXPECT_GT(seen.torque_range_nm[elbow_], 0.05);
  EXPECT_NEAR(seen.arm_speed_rad_s, 0.35 * 1.57 / std::sqrt(2.0), 0.03);
  EXPECT_EQ(seen.neck_range_rad, 0.0);
  EXPECT_NEAR(seen.reading_period_s, 0.01, 1e-6);
}

TEST_F(Motion, TurningPointsAreOfTheMotionAndNotOfTheNoise) {
  EXPECT_EQ(reversals(swinging), 6);  // three swings in twelve seconds, two turns each
  EXPECT_EQ(reversals([](double t) { return 0.5 + 0.05 * t; }), 0);
  // A tenth of a degree of noise on a slow way there.
  EXPECT_EQ(reversals([](double t) { return 0.5 + 0.05 * t + 0.0017 * std::sin(300.0 * t); }), 0);
  // To, fro, to: two turns, whichever way it sets out.
  for (const double way : {1.0, -1.0}) {
    EXPECT_EQ(reversals([&](double t) { return 1.2 + way * 0.1 * (t < 4 ? t : t < 8 ? 8 - t : t - 8); }), 2) << way;
  }
}

TEST_F(Motion, ReadingsArePickedOutOfMessagesThatRepeatThem) {
  // The arm is read ten times a second, the head more often.
  auto encoders = moving(100.0, swinging);
  for (std::size_t i = 0; i < encoders.size(); ++i) encoders[i].q[elbow_] = encoders[i - i % 10].q[elbow_];
  EXPECT_NEAR(motion(encoders).reading_period_s, 0.1, 1e-6);
  // Nothing moves: the messages' own period.
  EXPECT_NEAR(motion(moving(50.0, [](double) { return 1.0; })).reading_period_s, 0.02, 1e-4);
  EXPECT_GT(motion({}).reading_period_s, 1e6);
}

TEST_F(Motion, WithoutItNothingOfAJointCanBeTold) {
  const auto list = refused(moving(100.0, swinging));
  for (const char* name : {"encoder_gain", "eccentricity", "axis_tilt", "backlash"}) {
    const auto* item = find(list, {name, "r_wrist_pitch", ""});
    ASSERT_NE(item, nullptr) << name;
    EXPECT_THAT(item->reason, HasSubstr("r_wrist_pitch moved 0.")) << name;
    EXPECT_EQ(find(list, {name, "r_elbow", ""}), nullptr) << name;
  }
  EXPECT_EQ(find(list, {"latency", "", ""}), nullptr);
}

TEST_F(Motion, OneWayShowsNoBacklash) {
  const auto list = refused(moving(100.0, [](double t) { return 0.5 + 0.05 * t; }));
  const auto* item = find(list, {"backlash", "r_elbow", ""});
  ASSERT_NE(item, nullptr);
  EXPECT_THAT(item->reason, HasSubstr("turned round never"));
}

TEST_F(Motion, AnArmThatCreepsShowsNoLatency) {
  const auto list = refused(moving(100.0, [](double t) { return 0.5 + 0.001 * t; }));
  EXPECT_NE(find(list, {"latency", "", ""}), nullptr);
}

TEST_F(Motion, OneCameraTellsNothingBetweenTwo) {
  const auto list = refused(moving(100.0, swinging), 1);
  for (const char* name : {"camera_skew", "vergence", "baseline", "camera_pair", "first_camera"}) {
    EXPECT_NE(find(list, {name, "", ""}), nullptr) << name;
  }
  EXPECT_EQ(find(list, {"latency", "", ""}), nullptr);
}

TEST_F(Motion, RareReadingsKnowNoDirection) {
  const auto list = refused(moving(20.0, swinging));
  const auto* item = find(list, {"backlash", "r_elbow", ""});
  ASSERT_NE(item, nullptr);
  EXPECT_THAT(item->reason, HasSubstr("every 50 ms"));
}

/// A robot that publishes its encoders only where a posture is reached: rare messages, or frequent ones that repeat
/// the last posture. That 100 Hz are missing is not the reason then.
TEST_F(Motion, ReadingsThatJumpKnowNoDirection) {
  const auto steps = [](double t) { return static_cast<int>(t / 0.8) % 2 == 0 ? 1.0 : 1.3; };
  for (const double rate_hz : {1.25, 100.0}) {
    const auto list = refused(moving(rate_hz, steps));
    const auto* item = find(list, {"backlash", "r_elbow", ""});
    ASSERT_NE(item, nullptr) << rate_hz;
    EXPECT_THAT(item->reason, HasSubstr("jump from posture to posture")) << rate_hz;
    EXPECT_THAT(item->reason, Not(HasSubstr(" ms"))) << rate_hz;
  }
}

}  // namespace
}  // namespace bodyschema::diagnosis
