#include "bodyschema/outline/odd_pieces.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "random_seed.hpp"

namespace bodyschema {
namespace {

constexpr double kSd_px = 0.4, kSpacing_px = 3.0, kSearch_px = 5.0;

/// A round outline whose residuals are noise.
std::vector<OutlineSample> ring(std::size_t count, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0.0, kSd_px);
  std::vector<OutlineSample> samples(count);
  const double radius = kSpacing_px * static_cast<double>(count) / (2.0 * M_PI);
  for (std::size_t i = 0; i < count; ++i) {
    const double angle = 2.0 * M_PI * static_cast<double>(i) / static_cast<double>(count);
    samples[i].normal = {std::cos(angle), std::sin(angle)};
    samples[i].pixel = Eigen::Vector2d(160.0, 120.0) + radius * samples[i].normal;
    samples[i].residual_px = noise(random);
  }
  return samples;
}

std::size_t odd(const std::vector<OutlineSample>& samples) {
  return static_cast<std::size_t>(std::count_if(samples.begin(), samples.end(), [](const auto& s) { return s.odd; }));
}

TEST(OddPieces, AnOutlineOfTheRobotHasNone) {
  const auto seed = test::seed();
  for (std::uint64_t i = 0; i < 20; ++i) {
    auto samples = ring(100, seed + i);
    OddPieces().find(samples, kSd_px, kSpacing_px, kSearch_px);
    EXPECT_LE(odd(samples), 1u) << "seed " << seed + i;
  }
}

/// But for what lies within the noise of where the robot would be, which does no harm.
TEST(OddPieces, APieceThatSomethingHidesIsOdd) {
  std::mt19937_64 random(test::seed());
  std::uniform_real_distribution<double> anywhere(-kSearch_px, kSearch_px);
  double hidden = 0.0, found = 0.0, beside = 0.0;
  for (int trial = 0; trial < 50; ++trial) {
    auto samples = ring(100, random());
    for (std::size_t i = 30; i < 50; ++i) {  // edges of something else, some of them near by chance, or none
      samples[i].residual_px.reset();
      if (i % 2 == 0) samples[i].residual_px = anywhere(random);
    }
    OddPieces().find(samples, kSd_px, kSpacing_px, kSearch_px);
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const bool inside = i >= 30 && i < 50;
      const bool harmful = inside && std::abs(samples[i].residual_px.value_or(kSearch_px)) > 3.0 * kSd_px;
      hidden += harmful;
      found += harmful && samples[i].odd;
      beside += !inside && samples[i].odd;
    }
  }
  EXPECT_GT(found, 0.85 * hidden);
  EXPECT_LT(beside, 0.05 * hidden);
}

TEST(OddPieces, OneSampleFarOffIsNoise) {
  auto samples = ring(100, 7);
  samples[40].residual_px.reset();
  samples[70].residual_px = 4.5;
  OddPieces().find(samples, kSd_px, kSpacing_px, kSearch_px);
  EXPECT_EQ(odd(samples), 0u);
}

TEST(OddPieces, TheOtherFlankOfAThinLimbDecidesForItself) {
  // Two straight edges 4 px apart; one is hidden.
  std::vector<OutlineSample> samples;
  for (int i = 0; i < 30; ++i) {
    samples.push_back({0, {100.0 + kSpacing_px * i, 100.0}, {0.0, -1.0}, 0.1});
    samples.push_back({0, {100.0 + kSpacing_px * i, 104.0}, {0.0, 1.0}, std::nullopt});
  }
  OddPieces().find(samples, kSd_px, kSpacing_px, kSearch_px);
  for (std::size_t i = 0; i < samples.size(); ++i) EXPECT_EQ(samples[i].odd, i % 2 == 1) << i;
}

TEST(OddPieces, CoveredSamplesHaveNoSay) {
  auto samples = ring(100, 7);
  for (std::size_t i = 20; i < 40; ++i) {
    samples[i].covered = true;
    samples[i].residual_px.reset();
  }
  OddPieces().find(samples, kSd_px, kSpacing_px, kSearch_px);
  EXPECT_EQ(odd(samples), 0u);
}

}  // namespace
}  // namespace bodyschema
