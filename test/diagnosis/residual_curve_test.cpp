#include "residual_curve.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "bodyschema/geometry/pose.hpp"
#include "random_seed.hpp"

namespace bodyschema::diagnosis {
namespace {

constexpr double kStep_s = 0.1;
constexpr int kPictures = 602;  // of two cameras: as many in each of the 14 bins

using Variable = std::function<double(double time_s)>;
double time(double t) {
  return t;
}
double angle(double t) {
  return 60.0 + 20.0 * std::sin(0.9 * t) + 10.0 * std::sin(0.37 * t);
}

/// What is left is noise alone, which stays alike for so long, in two cameras.
/// @param shared   both err by the same
/// @param apart_s  from the left camera's stamp to the right one's
std::vector<ResidualPoint> noise(std::uint64_t seed, double correlation_s, bool shared = false, double apart_s = 0.0) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  const double kept = correlation_s > 0.0 ? std::exp(-kStep_s / correlation_s) : 0.0;
  std::vector<ResidualPoint> points;
  double y[2] = {normal(random), normal(random)};
  for (int i = 0; i < kPictures; ++i) {
    for (const std::size_t camera : {0u, 1u}) {
      y[camera] = kept * y[camera] + std::sqrt(1.0 - kept * kept) * normal(random);
      points.push_back({0.0, shared ? y[0] : y[camera], kStep_s * i + (camera == 0 ? 0.0 : apart_s), camera});
    }
  }
  return points;
}

std::vector<ResidualPoint> against(const Variable& x, std::vector<ResidualPoint> points) {
  for (auto& p : points) p.x = x(p.time_s);
  return points;
}

/// Share of the bands that hold zero, the truth.
double coverage(const Variable& x, double correlation_s, bool shared = false, double apart_s = 0.0) {
  int held = 0, all = 0;
  for (std::uint64_t i = 0; i < 40; ++i) {
    const auto points = against(x, noise(test::seed() + i, correlation_s, shared, apart_s));
    const auto curve = residual_curve(points, error_memory(points));
    for (std::size_t b = 0; b < curve.y.size(); ++b) held += curve.low[b] <= 0.0 && curve.high[b] >= 0.0;
    all += static_cast<int>(curve.y.size());
  }
  return static_cast<double>(held) / all;
}

TEST(ResidualCurve, BandsHoldWhatErrsAlikeForAWhile) {
  for (const double correlation_s : {0.0, 0.2, 0.5}) {
    EXPECT_GE(coverage(time, correlation_s), 0.9) << correlation_s;
    EXPECT_GE(coverage(angle, correlation_s), 0.9) << correlation_s;
    EXPECT_GE(coverage(angle, correlation_s, true), 0.9) << correlation_s;
    EXPECT_GE(coverage(angle, correlation_s, true, 0.005), 0.92) << correlation_s;
  }
}

TEST(ResidualCurve, BandsOfIndependentPicturesAreAsNarrowAsTheyMayBe) {
  double wider = 0.0;
  for (std::uint64_t i = 0; i < 20; ++i) {
    const auto points = against(angle, noise(test::seed() + i, 0.0));
    const auto curve = residual_curve(points, error_memory(points)), naive = residual_curve(points, {});
    wider += (curve.high[7] - curve.low[7]) / (naive.high[7] - naive.low[7]) / 20.0;
  }
  EXPECT_LT(wider, 1.2);
}

/// The spread within a bin that is shorter than the memory says nothing of what all its points err in alike: bands were
/// some ten times the noise wide.
TEST(ResidualCurve, BandsOfBinsShorterThanTheMemoryAreThoseOfTheNoise) {
  constexpr std::size_t kFine = 100;
  int held = 0, all = 0;
  double half = 0.0;
  for (std::uint64_t i = 0; i < 40; ++i) {
    const auto points = against(time, noise(test::seed() + i, 0.5, i % 2 == 0));
    const auto curve = residual_curve(points, error_memory(points), true, kFine);
    ASSERT_EQ(curve.y.size(), kFine);
    for (std::size_t b = 0; b < kFine; ++b, ++all) {
      held += curve.low[b] <= 0.0 && curve.high[b] >= 0.0;
      half += 0.5 * (curve.high[b] - curve.low[b]);
    }
  }
  EXPECT_GE(static_cast<double>(held) / all, 0.9);
  EXPECT_LT(half / all, 2.6) << "the noise has a standard deviation of one";
}

TEST(ErrorMemory, IsThatOfTheSigns) {
  // Of Gaussian noise the signs' correlation is 2 / pi asin of its own.
  double kept = 0.0, expected = 0.0;
  for (int lag = 1; lag < 100; ++lag) expected += std::asin(std::exp(-kStep_s * lag / 0.5)) * 2.0 / kPi;
  for (std::uint64_t i = 0; i < 20; ++i) {
    const auto memory = error_memory(noise(test::seed() + i, 0.5, i % 2 == 0));
    EXPECT_NEAR(memory.step_s, kStep_s, 1e-9);
    EXPECT_NEAR(memory.shared, i % 2 == 0 ? 1.0 : 0.0, 0.35);
    kept += memory.kept / 20.0;
  }
  EXPECT_NEAR(kept, expected / (1.0 + expected), 0.07);
}

TEST(ErrorMemory, OfTooFewOrOneTimeIsNone) {
  EXPECT_EQ(error_memory({}).kept, 0.0);
  const std::vector<ResidualPoint> one_time(40, {0.0, 1.0, 3.0, 0});
  EXPECT_EQ(error_memory(one_time).kept, 0.0);
}

TEST(ResidualCurve, PicturesShownTwiceSharpenNothing) {
  const auto points = against(angle, noise(test::seed(), 0.2));
  std::vector<ResidualPoint> twice;
  for (const auto& p : points) twice.insert(twice.end(), {p, p});
  const auto memory = error_memory(points);
  const auto one = residual_curve(points, memory), two = residual_curve(twice, memory);
  ASSERT_EQ(one.sd.size(), two.sd.size());
  for (std::size_t b = 0; b < one.sd.size(); ++b) EXPECT_NEAR(two.sd[b], one.sd[b], 0.15 * one.sd[b]);
}

/// A line that follows something stands out of the band that its noise has.
TEST(ResidualCurve, FollowsWhatItsPointsFollow) {
  auto points = against(angle, noise(test::seed(), 0.2));
  const auto memory = error_memory(points);
  for (auto& p : points) p.y += 0.1 * (p.x - 60.0);
  const auto curve = residual_curve(points, memory);
  EXPECT_LT(curve.high.front(), 0.0);
  EXPECT_GT(curve.low.back(), 0.0);
  EXPECT_GT(curve.structure(), 20.0);
  EXPECT_NEAR(curve.size(), 1.5, 0.5);
}

}  // namespace
}  // namespace bodyschema::diagnosis
