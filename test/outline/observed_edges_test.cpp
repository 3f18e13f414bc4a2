#include "bodyschema/outline/observed_edges.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace bodyschema {
namespace {

constexpr int kWidth = 64, kHeight = 48;

/// A picture that is robot left of u = `edge_u`, between pixel centres too.
struct HalfPlane {
  explicit HalfPlane(double edge_u) : mask(kWidth, kHeight) {
    for (int v = 0; v < kHeight; ++v) {
      for (int u = 0; u < kWidth; ++u) {
        // Of the pixel from u - 0.5 to u + 0.5.
        const double share = std::clamp(edge_u - (u - 0.5), 0.0, 1.0);
        coverage.push_back(static_cast<std::uint8_t>(std::lround(255.0 * share)));
        mask.set(u, v, share >= 0.5);
      }
    }
  }
  BinaryMask mask, valid;
  std::vector<std::uint8_t> coverage;
  [[nodiscard]] ObservedEdges edges() const { return {coverage, mask, valid, kWidth, kHeight}; }
  [[nodiscard]] ObservedEdges of_the_mask() const { return {{}, mask, valid, kWidth, kHeight}; }
};

const Eigen::Vector2d kRight(1.0, 0.0), kLeft(-1.0, 0.0);

TEST(ObservedEdges, AreFoundToAFractionOfAPixelFromBothSides) {
  for (const double edge : {30.0, 30.2, 30.5, 30.8}) {
    const HalfPlane picture(edge);
    for (const double from : {25.3, 29.0, 30.4, 33.0, 36.5}) {
      const auto found = picture.edges().find({from, 20.0}, kRight, 8.0);
      ASSERT_TRUE(found) << edge << " from " << from;
      EXPECT_NEAR(*found, edge - from, 0.12) << edge << " from " << from;
    }
  }
  // Along a slanted normal it lies further off.
  const Eigen::Vector2d slanted = Eigen::Vector2d(1.0, 1.0).normalized();
  EXPECT_NEAR(*HalfPlane(30.0).edges().find({27.0, 20.0}, slanted, 8.0), 3.0 * std::sqrt(2.0), 0.15);
}

TEST(ObservedEdges, OfAMaskWithoutCoverageAreItsPixels) {
  const auto found = HalfPlane(30.0).of_the_mask().find({27.0, 20.0}, kRight, 8.0);
  ASSERT_TRUE(found);
  EXPECT_NEAR(*found, 3.0, 0.5);
}

TEST(ObservedEdges, AreOutlinesOnlyWhereTheRobotEndsOutwards) {
  EXPECT_FALSE(HalfPlane(30.0).edges().find({30.0, 20.0}, kLeft, 8.0)) << "the robot begins there";
}

TEST(ObservedEdges, BeyondTheSearchThePictureAndWhatCountsAreNone) {
  HalfPlane picture(30.0);
  EXPECT_FALSE(picture.edges().find({20.0, 20.0}, kRight, 8.0));
  EXPECT_TRUE(picture.edges().find({20.0, 20.0}, kRight, 11.0));
  EXPECT_FALSE(HalfPlane(63.0).edges().find({60.0, 20.0}, kRight, 8.0)) << "at the border nothing is known";
  EXPECT_FALSE(picture.edges().find({-30.0, 20.0}, kRight, 8.0));
  picture.valid = BinaryMask(kWidth, kHeight);
  EXPECT_FALSE(picture.edges().find({29.0, 20.0}, kRight, 8.0)) << "no pixel counts";
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) picture.valid.set(u, v, u < 29 || u > 31);
  }
  EXPECT_FALSE(picture.edges().find({27.0, 20.0}, kRight, 8.0)) << "the edge lies where pixels do not count";
}

TEST(ObservedEdges, TheNearestOfSeveralCounts) {
  HalfPlane picture(20.0);
  // A second piece further out, from 26 to 34.
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 26; u < 34; ++u) picture.coverage[static_cast<std::size_t>(v * kWidth + u)] = 255;
  }
  EXPECT_NEAR(*picture.edges().find({22.0, 20.0}, kRight, 16.0), -2.0, 0.15);
  EXPECT_NEAR(*picture.edges().find({32.0, 20.0}, kRight, 16.0), 1.5, 0.15);
}

}  // namespace
}  // namespace bodyschema
