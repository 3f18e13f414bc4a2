#include "colour_resolution.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "compressed.hpp"
#include "scene.hpp"

namespace bodyschema {
namespace {

using test::compressed;
using test::Scene;
using test::Texture;

Scene scene_of(Texture texture) {
  Scene scene;
  scene.texture = texture;
  scene.shapes = test::hand(78.0, 62.0);
  return scene;
}

TEST(ColourResolution, IsLowerInCompressedPictures) {
  std::mt19937 random(7);
  for (const auto texture : {Texture::kPlain, Texture::kGradient, Texture::kClutter}) {
    const auto picture = scene_of(texture).picture(random);
    EXPECT_FALSE(ColourResolution().bleeds(picture, 1)) << static_cast<int>(texture);
    for (const int quality : {60, 70, 80, 90}) {
      EXPECT_TRUE(ColourResolution().bleeds(compressed(picture, quality), 1))
          << static_cast<int>(texture) << ", " << quality;
    }
  }
}

TEST(ColourResolution, IsTheSameWhereNothingIsToBeSeenOrThereIsNoColour) {
  Image nothing(64, 48, 3);
  std::fill(nothing.data.begin(), nothing.data.end(), std::uint8_t{80});
  EXPECT_FALSE(ColourResolution().bleeds(nothing, 1));
  std::mt19937 random(8);
  Scene scene = scene_of(Texture::kPlain);
  scene.channels = 1;
  EXPECT_FALSE(ColourResolution().bleeds(scene.picture(random), 1));
  EXPECT_FALSE(ColourResolution().bleeds(Image(2, 2, 3), 1));
  scene.channels = 3;
  scene.noise_levels = 0.0;  // a picture of a renderer
  EXPECT_FALSE(ColourResolution().bleeds(scene.picture(random), 1));
}

TEST(ColourResolution, IsSeenWithinFourPicturesOnceTheyAreCompressed) {
  std::mt19937 random(9);
  const auto picture = scene_of(Texture::kClutter).picture(random);
  const auto after = compressed(picture, 70);
  ColourResolution resolution;
  EXPECT_FALSE(resolution.bleeds(picture, 1));
  for (int i = 0; i < 3; ++i) resolution.bleeds(after, 1);
  EXPECT_TRUE(resolution.bleeds(after, 1));
  for (int i = 0; i < 3; ++i) resolution.bleeds(picture, 1);
  EXPECT_FALSE(resolution.bleeds(picture, 1));
}

TEST(ColourResolution, IsAskedAnewOfPicturesOfAnotherSize) {
  std::mt19937 random(10);
  const auto picture = scene_of(Texture::kClutter).picture(random);
  ColourResolution resolution;
  EXPECT_FALSE(resolution.bleeds(Image(64, 48, 3), 1));
  EXPECT_TRUE(resolution.bleeds(compressed(picture, 70), 1));
}

}  // namespace
}  // namespace bodyschema
