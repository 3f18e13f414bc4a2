#include "bodyschema/vision/given_mask.hpp"

#include <gtest/gtest.h>

#include "bodyschema/camera/stereo_rig.hpp"
#include "bodyschema/core/error.hpp"

namespace bodyschema {
namespace {

constexpr int kWidth = 100, kHeight = 80;

/// Background with a rectangle of robot, columns [20, 60) and rows [10, 50).
Image with_arm() {
  Image picture(kWidth, kHeight, 1);
  for (int v = 10; v < 50; ++v) {
    for (int u = 20; u < 60; ++u) *picture.pixel(u, v) = kMaskRobot;
  }
  return picture;
}

void fill(Image& picture, int u0, int v0, int u1, int v1, std::uint8_t level) {
  for (int v = v0; v < v1; ++v) {
    for (int u = u0; u < u1; ++u) *picture.pixel(u, v) = level;
  }
}

struct Seen {
  BinaryMask mask, valid;
  std::vector<std::uint8_t> coverage;
  std::uint8_t covered(int u, int v) const { return coverage[static_cast<std::size_t>(v * kWidth + u)]; }
};

Seen read(const Image& picture, const VisionSetup& setup = {}, const Undistorter* lens = nullptr) {
  Seen seen;
  GivenMask(setup).read(picture, lens, seen.mask, seen.valid, seen.coverage);
  return seen;
}

TEST(GivenMask, IsTakenAsItIs) {
  const Seen seen = read(with_arm());
  EXPECT_EQ(seen.mask.count(), 40u * 40u);
  EXPECT_EQ(seen.valid.count(), static_cast<std::size_t>(kWidth * kHeight));
  EXPECT_TRUE(seen.mask.at(20, 10));
  EXPECT_FALSE(seen.mask.at(19, 10));
  EXPECT_EQ(seen.covered(20, 10), 255);
  EXPECT_EQ(seen.covered(19, 10), 0);
}

TEST(GivenMask, WhatIsNotKnownDoesNotCount) {
  Image picture = with_arm();
  fill(picture, 50, 0, 70, kHeight, kMaskUnknown);
  const Seen seen = read(picture);
  EXPECT_FALSE(seen.valid.at(50, 20));
  EXPECT_FALSE(seen.mask.at(50, 20));
  EXPECT_TRUE(seen.valid.at(49, 20) && seen.mask.at(49, 20));
  EXPECT_TRUE(seen.valid.at(70, 20));
  EXPECT_EQ(seen.valid.count(), static_cast<std::size_t>((kWidth - 20) * kHeight));
}

/// A mask in two pieces, as where something hides the arm, keeps both; specks are neither robot nor background.
TEST(GivenMask, SpecksBySizeAgainstTheLargestPieceAreNotKnown) {
  Image picture = with_arm();                 // 1600 px
  fill(picture, 70, 10, 80, 20, kMaskRobot);  // 100 px: 6 %
  fill(picture, 70, 40, 78, 48, kMaskRobot);  // 64 px: 4 %
  const Seen seen = read(picture);
  EXPECT_TRUE(seen.mask.at(75, 15) && seen.valid.at(75, 15));
  EXPECT_FALSE(seen.mask.at(73, 43));
  EXPECT_FALSE(seen.valid.at(73, 43));
  EXPECT_EQ(seen.covered(73, 43), 0);
  EXPECT_EQ(seen.valid.count(), static_cast<std::size_t>(kWidth * kHeight - 64));

  VisionSetup all;
  all.min_piece_share = 0.0;
  EXPECT_EQ(read(picture, all).mask.count(), 1600u + 164u);
}

TEST(GivenMask, SmallHolesAreFilledAndLargeOnesStay) {
  Image picture = with_arm();
  fill(picture, 30, 20, 32, 22, 0);
  fill(picture, 40, 20, 50, 30, 0);
  const Seen seen = read(picture);
  EXPECT_TRUE(seen.mask.at(30, 20));
  EXPECT_EQ(seen.covered(30, 20), 255);
  EXPECT_FALSE(seen.mask.at(45, 25));
}

TEST(GivenMask, AnEmptyOneSaysThatTheRobotIsNotThere) {
  const Seen seen = read(Image(kWidth, kHeight, 1));
  EXPECT_EQ(seen.mask.count(), 0u);
  EXPECT_EQ(seen.valid.count(), static_cast<std::size_t>(kWidth * kHeight));
}

/// Masks are made from pictures as the lens bends them: they are straightened like these, robot and unknown apart.
TEST(GivenMask, IsStraightenedWithItsPicture) {
  CameraModel camera;
  camera.intrinsics = {kWidth, kHeight, 80, 80, 49.5, 39.5};
  camera.distortion = {-0.3, 0, 0, 0, 0};
  const Undistorter lens(camera);
  Image picture = with_arm();
  fill(picture, 0, 60, kWidth, kHeight, kMaskUnknown);
  const Seen seen = read(picture, {}, &lens);
  const Image straight = lens.apply(with_arm());
  for (int v = 0; v < 55; ++v) {
    for (int u = 0; u < kWidth; ++u) EXPECT_EQ(seen.mask.at(u, v), *straight.pixel(u, v) >= 128) << u << ", " << v;
  }
  EXPECT_NE(seen.mask, read(picture).mask) << "a lens that bends nothing shows nothing";
  EXPECT_FALSE(seen.valid.at(50, 79));
  EXPECT_FALSE(seen.mask.at(50, 79)) << "unknown is not half robot";
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) EXPECT_FALSE(seen.mask.at(u, v) && v > 60);
  }
}

TEST(GivenMask, OfAnotherKindOrSizeIsAnError) {
  CameraModel camera;
  camera.intrinsics = {kWidth, kHeight, 80, 80, 49.5, 39.5};
  const Undistorter lens(camera);
  EXPECT_THROW(read(Image(kWidth, kHeight, 3)), DataError);
  EXPECT_THROW(read(Image(kWidth, kHeight - 1, 1), {}, &lens), DataError);
}

}  // namespace
}  // namespace bodyschema
