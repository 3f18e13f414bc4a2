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
    EXPECT_FALSE(colours_bleed(picture, 1)) << static_cast<int>(texture);
    for (const int quality : {60, 70, 80, 90}) {
      EXPECT_TRUE(colours_bleed(compressed(picture, quality), 1)) << static_cast<int>(texture) << ", " << quality;
    }
  }
}

TEST(ColourResolution, IsTheSameWhereNothingIsToBeSeenOrThereIsNoColour) {
  Image nothing(64, 48, 3);
  std::fill(nothing.data.begin(), nothing.data.end(), std::uint8_t{80});
  EXPECT_FALSE(colours_bleed(nothing, 1));
  std::mt19937 random(8);
  Scene scene = scene_of(Texture::kPlain);
  scene.channels = 1;
  EXPECT_FALSE(colours_bleed(scene.picture(random), 1));
  EXPECT_FALSE(colours_bleed(Image(2, 2, 3), 1));
  scene.channels = 3;
  scene.noise_levels = 0.0;  // a picture of a renderer
  EXPECT_FALSE(colours_bleed(scene.picture(random), 1));
}

}  // namespace
}  // namespace bodyschema
