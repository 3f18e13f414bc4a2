#include "bodyschema/simulator/outline_noise.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "bodyschema/geometry/pose.hpp"

namespace bodyschema::simulator {
namespace {

constexpr int kSide = 200;
constexpr double kRadius = 70.0;
constexpr int kAngles = 180;

/// A disc, a pixel's coverage by its distance from the outline.
std::vector<float> disc() {
  std::vector<float> coverage;
  for (int v = 0; v < kSide; ++v) {
    for (int u = 0; u < kSide; ++u) {
      const double r = std::hypot(u - 99.5, v - 99.5);
      coverage.push_back(static_cast<float>(std::clamp(kRadius - r + 0.5, 0.0, 1.0)));
    }
  }
  return coverage;
}

/// How far the outline lies outside the disc's, by angle.
std::vector<double> outline(const std::vector<float>& coverage) {
  std::vector<double> result;
  for (int a = 0; a < kAngles; ++a) {
    const double angle = 2.0 * kPi * a / kAngles;
    double length = 0.0;
    constexpr double kStep = 0.05;
    for (double r = kRadius - 12.0; r < kRadius + 12.0; r += kStep) {
      const double u = 99.5 + r * std::cos(angle), v = 99.5 + r * std::sin(angle);
      const int i = static_cast<int>(u), j = static_cast<int>(v);
      const double x = u - i, y = v - j;
      const auto c = [&](int du, int dv) {
        return static_cast<double>(coverage[static_cast<std::size_t>((j + dv) * kSide + i + du)]);
      };
      length += kStep * ((1 - y) * ((1 - x) * c(0, 0) + x * c(1, 0)) + y * ((1 - x) * c(0, 1) + x * c(1, 1)));
    }
    result.push_back(length - 12.0);
  }
  return result;
}

double correlation(const std::vector<double>& a, const std::vector<double>& b) {
  double aa = 0, bb = 0, ab = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    aa += a[i] * a[i];
    bb += b[i] * b[i];
    ab += a[i] * b[i];
  }
  return ab / std::sqrt(aa * bb);
}

/// Displacements of many independent pictures, one after the other.
std::vector<double> many(const OutlineNoise& noise, double t_s, int pictures, int shift = 0) {
  std::vector<double> result;
  for (int i = 0; i < pictures; ++i) {
    OutlineDisplacer displacer(kSide, kSide, noise, static_cast<std::uint64_t>(i), "test");
    auto coverage = disc();
    displacer.displace(t_s, 0, coverage);
    const auto line = outline(coverage);
    for (int a = 0; a < kAngles; ++a) result.push_back(line[static_cast<std::size_t>((a + shift) % kAngles)]);
  }
  return result;
}

class Sizes : public ::testing::TestWithParam<OutlineNoise> {};

TEST_P(Sizes, HaveTheStatedSpreadAndNoMean) {
  const auto noise = GetParam();
  const auto d = many(noise, 1.0, 120);
  double sum = 0.0, square = 0.0;
  for (const double x : d) {
    sum += x;
    square += x * x;
  }
  const auto n = static_cast<double>(d.size());
  // So many displacements are independent of each other.
  const double independent = 120.0 * 2.0 * kPi * kRadius / (2.5 * noise.length_px);
  EXPECT_NEAR(sum / n, 0.0, (0.02 + 3.0 / std::sqrt(independent)) * noise.sd_px);
  EXPECT_NEAR(std::sqrt(square / n), noise.sd_px, (0.06 + 2.0 / std::sqrt(independent)) * noise.sd_px);
}

INSTANTIATE_TEST_SUITE_P(OutlineDisplacer, Sizes,
                         ::testing::Values(OutlineNoise{0.3, 15.0, 0.3}, OutlineNoise{1.0, 15.0, 0.3},
                                           OutlineNoise{1.0, 5.0, 0.0}, OutlineNoise{2.5, 40.0, 0.3}));

TEST(OutlineDisplacer, CorrelatesAlongTheOutlineAndInTimeAsStated) {
  const OutlineNoise noise{1.0, 15.0, 0.4};
  const auto here = many(noise, 1.0, 80);
  const double step_px = 2.0 * kPi * kRadius / kAngles;
  const auto apart = [&](double px) {
    return correlation(here, many(noise, 1.0, 80, static_cast<int>(std::lround(px / step_px))));
  };
  EXPECT_NEAR(apart(7.5), std::exp(-0.125), 0.06);
  EXPECT_NEAR(apart(15.0), 0.61, 0.08);
  EXPECT_NEAR(apart(45.0), 0.0, 0.12);
  EXPECT_NEAR(correlation(here, many(noise, 1.1, 80)), std::exp(-0.25), 0.06);
  EXPECT_NEAR(correlation(here, many(noise, 1.4, 80)), 0.37, 0.08);
  EXPECT_NEAR(correlation(here, many(noise, 4.0, 80)), 0.0, 0.12);
}

TEST(OutlineDisplacer, BothSidesOfAFingerErrIndependently) {
  // A bar 10 px wide; noise is longer than that.
  std::vector<double> left, right;
  for (int i = 0; i < 150; ++i) {
    OutlineDisplacer displacer(60, 120, {0.7, 20.0, 0.3}, static_cast<std::uint64_t>(i), "test");
    std::vector<float> coverage(60 * 120, 0.0f);
    for (int v = 0; v < 120; ++v) {
      for (int u = 25; u < 35; ++u) coverage[static_cast<std::size_t>(v * 60 + u)] = 1.0f;
    }
    displacer.displace(0.0, 0, coverage);
    for (const int v : {30, 90}) {
      double l = 0, r = 0;
      for (int u = 0; u < 30; ++u) l += static_cast<double>(coverage[static_cast<std::size_t>(v * 60 + u)]);
      for (int u = 30; u < 60; ++u) r += static_cast<double>(coverage[static_cast<std::size_t>(v * 60 + u)]);
      left.push_back(l - 5.0);
      right.push_back(r - 5.0);
    }
  }
  EXPECT_NEAR(correlation(left, right), 0.0, 0.15);
  double square = 0.0;
  for (const double x : left) square += x * x;
  EXPECT_NEAR(std::sqrt(square / static_cast<double>(left.size())), 0.7, 0.1);
}

TEST(OutlineDisplacer, LeavesThePicturesBorderAloneAndIsRepeatable) {
  // An arm that comes in from below: its cut at the border is no outline.
  std::vector<float> coverage(60 * 80, 0.0f);
  for (int v = 30; v < 80; ++v) {
    for (int u = 20; u < 40; ++u) coverage[static_cast<std::size_t>(v * 60 + u)] = 1.0f;
  }
  const auto displaced = [&](double t_s) {
    OutlineDisplacer displacer(60, 80, {0.8, 10.0, 0.3}, 3, "test");
    auto copy = coverage;
    displacer.displace(t_s, 7, copy);
    return copy;
  };
  const auto moved = displaced(2.0);
  EXPECT_EQ(moved, displaced(2.0));
  EXPECT_NE(moved, displaced(2.5));
  EXPECT_NE(moved, coverage);
  for (int u = 24; u < 36; ++u) EXPECT_EQ(moved[static_cast<std::size_t>(79 * 60 + u)], 1.0f);
  OutlineDisplacer none(60, 80, {}, 3, "test");
  auto same = coverage;
  none.displace(2.0, 7, same);
  EXPECT_EQ(same, coverage);
}

}  // namespace
}  // namespace bodyschema::simulator
