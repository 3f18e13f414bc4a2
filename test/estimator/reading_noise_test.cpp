#include "reading_noise.hpp"

#include <gtest/gtest.h>

#include <random>

#include "bodyschema/geometry/pose.hpp"
#include "random_seed.hpp"

namespace bodyschema {
namespace {

class ReadingNoiseTest : public testing::Test {
 protected:
  /// Readings at 100 Hz of two joints that turn, the second without noise.
  std::vector<JointSample> readings(int n, double noise_deg) {
    std::normal_distribution<double> noise(0.0, radians(noise_deg));
    std::vector<JointSample> list;
    for (int i = 0; i < n; ++i, time_ += 10'000) {
      const double angle = 0.5 * std::sin(3e-6 * static_cast<double>(time_));
      list.push_back({time_, Eigen::Vector2d(angle + noise(random_), angle), {}});
    }
    return list;
  }
  std::mt19937_64 random_{test::seed()};
  Microseconds time_ = 0;
  ReadingNoise noise_{radians(0.035)};
};

TEST_F(ReadingNoiseTest, IsWhatIsMeasuredBeyondWhatIsBelieved) {
  for (int frame = 0; frame < 50; ++frame) noise_.read(readings(10, 0.3), frame == 0);
  const double between = 2.0 / 3.0 * std::pow(radians(0.3), 2);
  EXPECT_NEAR(noise_.beyond_belief_rad2(0), between, 0.3 * between);
  EXPECT_EQ(noise_.beyond_belief_rad2(1), 0.0);
}

TEST_F(ReadingNoiseTest, IsNoneWhileThereAreFewReadings) {
  noise_.read(readings(100, 0.3), true);
  EXPECT_EQ(noise_.beyond_belief_rad2(0), 0.0);
  EXPECT_EQ(noise_.beyond_belief_rad2(-1), 0.0);
}

/// An arm that is jerked from place to place five times a second: a quarter of the differences hold its motion.
TEST_F(ReadingNoiseTest, IsNoMotion) {
  std::vector<JointSample> list;
  for (int i = 0; i < 1200; ++i, time_ += 10'000) {
    list.push_back({time_, Eigen::VectorXd::Constant(1, i / 20 % 2 == 0 ? 0.3 : -0.3), {}});
  }
  noise_.read(list, true);
  EXPECT_EQ(noise_.beyond_belief_rad2(0), 0.0);
}

/// A clock that starts again leaves few readings: of these nothing is said, and what was measured stays.
TEST_F(ReadingNoiseTest, StaysWhereReadingsBeginAnew) {
  for (int frame = 0; frame < 59; ++frame) noise_.read(readings(10, 0.3), frame == 0);
  const double before = noise_.beyond_belief_rad2(0);
  EXPECT_GT(before, 0.0);
  time_ = 0;
  noise_.read(readings(10, 0.3), true);
  EXPECT_EQ(noise_.beyond_belief_rad2(0), before);
}

TEST_F(ReadingNoiseTest, FollowsAnEncoderThatGetsBetter) {
  for (int frame = 0; frame < 50; ++frame) noise_.read(readings(10, 0.3), frame == 0);
  for (int frame = 0; frame < 60; ++frame) noise_.read(readings(10, 0.02), false);
  EXPECT_EQ(noise_.beyond_belief_rad2(0), 0.0);
}

}  // namespace
}  // namespace bodyschema
