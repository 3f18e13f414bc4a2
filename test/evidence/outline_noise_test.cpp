#include "bodyschema/evidence/outline_noise.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace bodyschema {
namespace {

/// Outlines whose residuals are made up: a straight flank, points 3 px apart.
class MadeUpOutline : public testing::Test {
 protected:
  static constexpr double kSpacing_px = 3.0;

  /// Residuals of deviation `sd` that are the mean of `alike` neighbours' noise: so many err as one.
  std::vector<OutlinePoint> flank(std::size_t n, double sd, int alike, const Eigen::Vector2d& normal = {0.0, -1.0},
                                  double v = 100.0) {
    std::normal_distribution<double> normal_noise(0.0, sd * std::sqrt(static_cast<double>(alike)));
    std::vector<double> white(n + static_cast<std::size_t>(alike));
    for (double& w : white) w = normal_noise(random_);
    std::vector<OutlinePoint> points(n);
    for (std::size_t i = 0; i < n; ++i) {
      points[i].pixel = {20.0 + kSpacing_px * static_cast<double>(i), v};
      points[i].normal = normal;
      for (int k = 0; k < alike; ++k) points[i].residual_px += white[i + static_cast<std::size_t>(k)] / alike;
    }
    weigh(points, 4.0);
    return points;
  }
  static void weigh(std::vector<OutlinePoint>& points, double robust_px) {
    for (auto& p : points) {
      const double c2 = robust_px * robust_px;
      p.weight = std::pow(c2 / (p.residual_px * p.residual_px + c2), 2);
    }
  }

  std::mt19937 random_{11};
  OutlineNoise::Prior prior_;
};

TEST_F(MadeUpOutline, BeforeAnyPictureItIsWhatWasBelieved) {
  prior_ = {.sd_px = 0.7, .floor_px = 0.2, .correlated_points = 5.0, .pictures = 3.0};
  const OutlineNoise noise(prior_);
  EXPECT_DOUBLE_EQ(noise.sd_px(), 0.7);
  EXPECT_DOUBLE_EQ(noise.correlated_points(), 5.0);
  EXPECT_NEAR(noise.variance_px2(), 5.0 * 0.49 + 12.0 * 0.04, 1e-12);
  EXPECT_EQ(noise.correlation_px(), 0.0);
}

TEST_F(MadeUpOutline, DeviationAndLengthAreMeasured) {
  prior_.floor_px = 0.0;
  for (const int alike : {1, 4, 8}) {
    OutlineNoise noise(prior_);
    for (int i = 0; i < 300; ++i) noise.add(flank(80, 0.3, alike), 1.0);
    EXPECT_NEAR(noise.sd_px(), 0.3, 0.03) << alike;
    // 1 + 2 sum of the triangle (1 - k / alike): as many points as were averaged.
    EXPECT_NEAR(noise.correlated_points(), alike, 0.25 * alike) << alike;
  }
}

/// What it is for: how far a flank as a whole is off, over many pictures, against what is claimed.
TEST_F(MadeUpOutline, AFlanksPlaceIsKnownAsWellAsIsClaimed) {
  prior_.floor_px = 0.0;
  constexpr std::size_t kPoints = 80;
  for (const int alike : {1, 6}) {
    OutlineNoise noise(prior_);
    double square = 0.0;
    constexpr int kPictures = 600;
    for (int i = 0; i < kPictures; ++i) {
      const auto points = flank(kPoints, 0.4, alike);
      noise.add(points, 1.0);
      double place = 0.0, weight = 0.0;
      for (const auto& p : points) {
        place += p.weight * p.residual_px;
        weight += p.weight;
      }
      square += std::pow(place / weight, 2);
    }
    const double claimed = noise.variance_px2() / kPoints;
    EXPECT_NEAR(square / kPictures / claimed, 1.0, 0.3) << alike;
  }
}

TEST_F(MadeUpOutline, HowLongItIsAlikeIsALengthInThePicture) {
  OutlineNoise noise(prior_);
  for (int i = 0; i < 200; ++i) noise.add(flank(80, 0.3, 8), 1.0);
  EXPECT_GE(noise.correlation_px(), 9.0);
  EXPECT_LE(noise.correlation_px(), 18.0);
  OutlineNoise white(prior_);
  for (int i = 0; i < 200; ++i) white.add(flank(80, 0.3, 1), 1.0);
  EXPECT_LE(white.correlation_px(), 3.0);
}

/// A tool that no mesh shows is no noise of outlines.
TEST_F(MadeUpOutline, WhatLiesFarOffDoesNotCount) {
  OutlineNoise clean(prior_), with_tool(prior_);
  for (int i = 0; i < 100; ++i) {
    auto points = flank(80, 0.3, 1);
    clean.add(points, 1.0);
    for (std::size_t k = 0; k < 12; ++k) points[k].residual_px = 9.0;
    weigh(points, 1.2);
    with_tool.add(points, 1.0);
  }
  EXPECT_NEAR(with_tool.sd_px(), clean.sd_px(), 0.25 * clean.sd_px());
}

/// Opposite flanks of a limb that is too thick err each outwards; they are no evidence for each other.
TEST_F(MadeUpOutline, OnlyPointsOfOneSideAreAlike) {
  OutlineNoise one(prior_), two(prior_);
  for (int i = 0; i < 300; ++i) {
    const auto upper = flank(60, 0.3, 1);
    auto both = upper;
    for (auto point : upper) {  // the same residuals 6 px below, looking the other way
      point.pixel.y() += 6.0;
      point.normal = -point.normal;
      both.push_back(point);
    }
    one.add(upper, 1.0);
    two.add(both, 1.0);
  }
  EXPECT_NEAR(two.correlated_points(), one.correlated_points(), 0.2);
}

TEST_F(MadeUpOutline, LengthsAreThoseOfASmallPicture) {
  OutlineNoise small(prior_), large(prior_);
  for (int i = 0; i < 100; ++i) {
    auto points = flank(80, 0.3, 4);
    small.add(points, 1.0);
    for (auto& p : points) {
      p.pixel *= 4.0;
      p.residual_px *= 4.0;
    }
    large.add(points, 4.0);
  }
  EXPECT_NEAR(large.sd_px(), small.sd_px(), 1e-9);
  EXPECT_NEAR(large.correlated_points(), small.correlated_points(), 1e-9);
  EXPECT_NEAR(large.variance_px2(), small.variance_px2(), 1e-9);
}

TEST_F(MadeUpOutline, OldPicturesFadeOnlyWhereTheyAreTo) {
  OutlineNoise fading(prior_), all(prior_);
  for (int i = 0; i < 200; ++i) {
    const auto points = flank(80, i < 100 ? 0.8 : 0.2, 1);
    fading.add(points, 1.0, 20.0);
    all.add(points, 1.0);
  }
  EXPECT_NEAR(fading.sd_px(), 0.2, 0.05);
  EXPECT_GT(all.sd_px(), 0.4);
}

TEST_F(MadeUpOutline, TooFewPointsSayNothing) {
  OutlineNoise noise(prior_);
  noise.add(flank(19, 5.0, 1), 1.0);
  EXPECT_DOUBLE_EQ(noise.sd_px(), prior_.sd_px);
  noise.add(flank(60, 5.0, 1), 1.0);
  EXPECT_GT(noise.sd_px(), prior_.sd_px);
}

/// However smooth residuals are: light shifts the outline of a whole flank.
TEST_F(MadeUpOutline, NoPicturePlacesAFlankNearerThanTheFloor) {
  prior_.floor_px = 0.1;
  OutlineNoise noise(prior_);
  for (int i = 0; i < 500; ++i) noise.add(flank(80, 0.001, 1), 1.0);
  EXPECT_GT(noise.variance_px2(), 12.0 * 0.01);
  EXPECT_EQ(noise.robust_px(), 1.0) << "nor does a robust scale become finer than pictures are";
  OutlineNoise rough(prior_);
  for (int i = 0; i < 100; ++i) rough.add(flank(80, 3.0, 1), 1.0);
  EXPECT_EQ(rough.robust_px(), 4.0) << "what lies further off is something else";
}

}  // namespace
}  // namespace bodyschema
