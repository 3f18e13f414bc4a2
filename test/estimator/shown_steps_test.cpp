#include "../../src/estimator/shown_steps.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "random_seed.hpp"

namespace bodyschema {
namespace {

constexpr int kWidth = 320, kHeight = 240;

/// A disc of this radius about the middle of a picture, and everything else.
Image disc_picture(double radius_px, int channels, int scale = 1) {
  Image image(kWidth * scale, kHeight * scale, channels);
  for (int v = 0; v < image.height; ++v) {
    for (int u = 0; u < image.width; ++u) {
      const bool inside = std::hypot(u - 160.0 * scale, v - 120.0 * scale) < radius_px * scale;
      auto* pixel =
          image.data.data() + static_cast<std::size_t>(v * image.width + u) * static_cast<std::size_t>(channels);
      for (int c = 0; c < channels; ++c) pixel[c] = static_cast<std::uint8_t>(inside ? 90 + 10 * c : 70 + 20 * c);
    }
  }
  return image;
}

/// The outline of such a disc as it would be predicted.
std::vector<OutlineSample> circle(double radius_px, double u0 = 160.0, double v0 = 120.0, int scale = 1) {
  std::vector<OutlineSample> samples;
  constexpr int kCount = 100;
  for (int i = 0; i < kCount; ++i) {
    const double angle = 2.0 * 3.14159265358979 * i / kCount;
    OutlineSample sample;
    sample.normal = {std::cos(angle), std::sin(angle)};
    sample.pixel = scale * (Eigen::Vector2d(u0, v0) + radius_px * sample.normal);
    samples.push_back(sample);
  }
  return samples;
}

double share(const ShownSteps& steps) {
  return steps.shown / steps.looked;
}

TEST(ShownSteps, AnOutlineThatThePictureHasIsShownOneElsewhereIsNot) {
  for (const int channels : {1, 3}) {
    const Image image = disc_picture(60.0, channels);
    EXPECT_GT(share(shown_steps(image, circle(60.0), 1.0)), 0.95) << channels;
    EXPECT_LT(share(shown_steps(image, circle(64.0), 1.0)), 0.05) << "seen, but not where it is predicted";
    EXPECT_LT(share(shown_steps(image, circle(60.0, 200.0, 140.0), 1.0)), 0.2) << channels;
  }
}

/// Whatever a picture is full of, an outline that it knows nothing of gets no more than chance: 3 places of 11.
TEST(ShownSteps, OfAnOutlineThatThePictureKnowsNothingOfChanceShowsThreeInEleven) {
  Image image(kWidth, kHeight, 3);
  std::mt19937_64 random(test::seed());
  std::uniform_int_distribution<int> level(0, 255);
  for (auto& value : image.data) value = static_cast<std::uint8_t>(level(random));
  ShownSteps all;
  for (double radius_px = 20.0; radius_px < 100.0; radius_px += 4.0) {
    const ShownSteps own = shown_steps(image, circle(radius_px), 1.0);
    all.looked += own.looked;
    all.shown += own.shown;
  }
  EXPECT_NEAR(share(all), 3.0 / 11.0, 0.06);
  const Image flat(kWidth, kHeight, 3);
  EXPECT_EQ(shown_steps(flat, circle(60.0), 1.0).shown, 0.0) << "where there is no step none is shown";
}

TEST(ShownSteps, LengthsGrowWithThePicture) {
  const Image large = disc_picture(60.0, 3, 2);
  EXPECT_GT(share(shown_steps(large, circle(60.0, 160.0, 120.0, 2), 2.0)), 0.95);
  EXPECT_GT(share(shown_steps(large, circle(60.5, 160.0, 120.0, 2), 2.0)), 0.95);
  EXPECT_LT(share(shown_steps(large, circle(64.0, 160.0, 120.0, 2), 2.0)), 0.05);
}

TEST(ShownSteps, WhatSomethingCoversOrThePictureCutsOffIsNotLookedAt) {
  const Image image = disc_picture(60.0, 3);
  auto samples = circle(60.0);
  for (std::size_t i = 0; i < 30; ++i) samples[i].covered = true;
  EXPECT_EQ(shown_steps(image, samples, 1.0).looked, 70.0);
  EXPECT_LT(shown_steps(image, circle(119.0), 1.0).looked, 90.0);
  EXPECT_EQ(shown_steps(image, circle(400.0), 1.0).looked, 0.0);
}

TEST(ShownSteps, AFrameWithoutPicturesSaysNothing) {
  CameraObservation seen;
  Frame frame;
  frame.seen = {&seen, nullptr};
  FrameEvidence evidence;
  evidence.samples = {circle(60.0), {}};
  EXPECT_FALSE(shown_share(frame, evidence));
  seen.image = disc_picture(60.0, 3);
  ASSERT_TRUE(shown_share(frame, evidence));
  EXPECT_GT(*shown_share(frame, evidence), 0.95);
}

}  // namespace
}  // namespace bodyschema
