#include "bodyschema/observation/joint_motion.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "bodyschema/geometry/pose.hpp"

namespace bodyschema {
namespace {

constexpr double kAmplitude = 0.5;  // rad
constexpr double kOmega = 3.0;      // rad/s: a reach to and fro in two seconds

JointSample swing(Microseconds utime) {
  JointSample sample;
  sample.utime = utime;
  sample.q = Eigen::Vector2d(kAmplitude * std::sin(kOmega * seconds(utime)), 0.3);
  return sample;
}

struct Motion {
  Eigen::VectorXd qdot, qddot;
};

Motion motion(const std::vector<JointSample>& samples, Microseconds utime) {
  Motion result;
  joint_motion(samples, utime, result.qdot, result.qddot);
  return result;
}

std::vector<JointSample> every(Microseconds period, Microseconds until) {
  std::vector<JointSample> samples;
  for (Microseconds t = 0; t <= until; t += period) samples.push_back(swing(t));
  return samples;
}

TEST(JointMotion, IsThatOfASwingAtAnyEncoderRate) {
  for (const Microseconds period : {1'000, 10'000, 20'000, 50'000}) {
    const auto samples = every(period, 4'000'000);
    for (Microseconds t = 500'000; t < 3'500'000; t += 37'000) {
      const auto at = motion(samples, t);
      EXPECT_NEAR(at.qdot[0], kAmplitude * kOmega * std::cos(kOmega * seconds(t)), 0.03 * kAmplitude * kOmega)
          << period;
      EXPECT_NEAR(at.qddot[0], -kAmplitude * kOmega * kOmega * std::sin(kOmega * seconds(t)),
                  0.15 * kAmplitude * kOmega * kOmega)
          << period;
      EXPECT_EQ(at.qdot[1], 0.0);
    }
  }
}

/// Twelve bits over a turn and 3 deg/s: a single step of the encoder lasts three samples.
TEST(JointMotion, SeesSlowMotionThroughACoarseEncoder) {
  const double step = 2.0 * std::numbers::pi / 4096.0;
  const double speed = radians(3.0);
  std::vector<JointSample> samples;
  for (Microseconds t = 0; t <= 2'000'000; t += 10'000) {
    JointSample sample;
    sample.utime = t;
    sample.q = Eigen::VectorXd::Constant(1, std::round(speed * seconds(t) / step) * step);
    samples.push_back(sample);
  }
  double sum = 0.0, square = 0.0;
  int count = 0;
  for (Microseconds t = 500'000; t < 1'500'000; t += 13'000, ++count) {
    sum += motion(samples, t).qdot[0];
    square += std::pow(motion(samples, t).qddot[0], 2);
  }
  EXPECT_NEAR(degrees(sum / count), 3.0, 0.1);
  // Over 60 ms the steps look like 11 deg/s^2.
  EXPECT_LT(degrees(std::sqrt(square / count)), 2.5);
}

TEST(JointMotion, NeedsLittleAfterTheInstant) {
  for (Microseconds t = 500'000; t < 3'500'000; t += 37'000) {
    const auto at = motion(every(10'000, t + 10'000), t);
    EXPECT_NEAR(at.qdot[0], kAmplitude * kOmega * std::cos(kOmega * seconds(t)), 0.06 * kAmplitude * kOmega);
  }
}

/// A recording of poses that were held one after the other, without the way between them.
TEST(JointMotion, AJumpBetweenTwoHoldsIsNoMotion) {
  std::vector<JointSample> samples;
  for (Microseconds t = 0; t <= 1'000'000; t += 17'000) {
    JointSample sample;
    sample.utime = t;
    sample.q = Eigen::VectorXd::Constant(1, t < 500'000 ? 0.0 : radians(4.0));
    samples.push_back(sample);
  }
  for (Microseconds t = 400'000; t < 600'000; t += 9'000) EXPECT_EQ(motion(samples, t).qdot[0], 0.0) << t;
}

TEST(JointMotion, APathIsKnownUpToWhereItsJointJumps) {
  const Microseconds t = 2'000'000, jump = 2'300'000;
  auto samples = every(10'000, 4'000'000);
  for (auto& sample : samples) {
    if (sample.utime >= jump) sample.q[1] += radians(4.0);
  }
  Eigen::MatrixXd path;
  joint_path(samples, t, path);
  ASSERT_EQ(path.cols(), 2 * kPathSteps + 1);
  for (Eigen::Index step = -kPathSteps; step <= kPathSteps; ++step) {
    const double after_s = static_cast<double>(step) * kPathStep_s;
    const Eigen::VectorXd there = swing(t + microseconds(after_s)).q - swing(t).q;
    EXPECT_NEAR(path(0, kPathSteps + step), there[0], 0.02 * kAmplitude) << after_s;
    if (after_s < 0.16) {
      EXPECT_NEAR(path(1, kPathSteps + step), there[1], 0.02 * kAmplitude) << after_s;
    } else if (after_s > 0.19) {
      EXPECT_TRUE(std::isnan(path(1, kPathSteps + step))) << after_s;
    }
  }
}

TEST(JointMotion, HeadAndArmPublishedInTurnsMoveAllTheSame) {
  std::vector<JointSample> samples;
  for (Microseconds t = 0; t <= 4'000'000; t += 10'000) {
    auto sample = swing(t);
    if (!samples.empty()) sample.q[0] = samples.back().q[0];  // the head's message: the arm's last value
    samples.push_back(sample);
    sample = swing(t + 1'000);
    samples.push_back(sample);
  }
  for (Microseconds t = 500'000; t < 3'500'000; t += 37'000) {
    EXPECT_NEAR(motion(samples, t).qdot[0], kAmplitude * kOmega * std::cos(kOmega * seconds(t)),
                0.05 * kAmplitude * kOmega);
  }
}

TEST(JointMotion, WithoutNeighboursThereIsNone) {
  EXPECT_EQ(motion({}, 0).qdot.size(), 0);
  EXPECT_EQ(motion({swing(0)}, 0).qdot, Eigen::Vector2d::Zero());
  EXPECT_EQ(motion({swing(0), swing(2'000'000)}, 1'000'000).qdot, Eigen::Vector2d::Zero());
}

}  // namespace
}  // namespace bodyschema
