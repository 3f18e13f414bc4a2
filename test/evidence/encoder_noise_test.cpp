#include "bodyschema/evidence/encoder_noise.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "bodyschema/geometry/pose.hpp"
#include "random_seed.hpp"

namespace bodyschema {
namespace {

constexpr double kDegree = kPi / 180.0;

/// A joint that goes to and fro by 40 deg in 2 s, read with noise and in steps.
std::vector<JointSample> readings(double noise_rad, double step_rad, double rate_hz = 100.0) {
  std::mt19937_64 random(test::seed());
  std::normal_distribution<double> normal(0.0, std::max(1e-12, noise_rad));
  std::vector<JointSample> list;
  for (int i = 0; i < 3000; ++i) {
    const double t = i / rate_hz;
    double q = 20.0 * kDegree * std::sin(kPi * t) + normal(random);
    if (step_rad > 0.0) q = step_rad * std::round(q / step_rad);
    list.push_back({microseconds(t), Eigen::VectorXd::Constant(1, q), {}});
  }
  return list;
}

TEST(EncoderNoise, IsThatOfReadingsAndNotOfMotion) {
  EXPECT_NEAR(encoder_noise(readings(0.02 * kDegree, 0.0))[0], 0.02 * kDegree, 0.002 * kDegree);
  EXPECT_LT(encoder_noise(readings(0.0, 0.0))[0], 0.005 * kDegree);
}

TEST(EncoderNoise, HoldsTheStepsOfAnEncoder) {
  const double step = 360.0 * kDegree / 4096.0;
  const double noise = encoder_noise(readings(0.02 * kDegree, step))[0];
  const double truth = std::hypot(0.02 * kDegree, step / std::sqrt(12.0));
  EXPECT_NEAR(noise, truth, 0.25 * truth);
}

TEST(EncoderNoise, IsNotToldBySlowReadings) {
  EXPECT_EQ(encoder_noise(readings(0.02 * kDegree, 0.0, 10.0))[0], 0.0);
  EXPECT_EQ(encoder_noise({}).size(), 0);
}

/// An arm that goes from posture to posture changes seldom, and then by about as much: that is no encoder's step. Of a
/// recording so made half of the frames lost their `converged`.
TEST(EncoderNoise, TakesFewMovesForNoSteps) {
  std::vector<JointSample> list;
  for (int i = 0; i < 400; ++i) list.push_back({10'000 * i, Eigen::VectorXd::Constant(1, 0.02 * (i / 50)), {}});
  EXPECT_NEAR(encoder_noise(list)[0], 0.0, 1e-9);
}

/// Readings that stall and jump now and then say nothing of the others.
TEST(EncoderNoise, BearsJumps) {
  auto list = readings(0.02 * kDegree, 0.0);
  for (std::size_t i = 0; i < list.size(); i += 100) list[i].q[0] += 5.0 * kDegree;
  EXPECT_NEAR(encoder_noise(list)[0], 0.02 * kDegree, 0.005 * kDegree);
}

}  // namespace
}  // namespace bodyschema
