#include "bodyschema/simulator/shadow_map.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace bodyschema::simulator {
namespace {

/// A square of half side `half` in its plane z = 0.
TriangleMesh plate(float half) {
  TriangleMesh mesh;
  mesh.vertices = {{-half, -half, 0}, {half, -half, 0}, {half, half, 0}, {-half, half, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  return mesh;
}

std::vector<Eigen::Isometry3f> at_height(float z) {
  Eigen::Isometry3f X = Eigen::Isometry3f::Identity();
  X.translation().z() = z;
  return {X};
}

/// Where along x the light on the floor goes through `share`, on the side of positive x.
float edge(const ShadowMap& map, float share, float offset) {
  for (float x = 0.0f; x < 0.3f; x += 0.0005f) {
    if (map.lit({x + offset, 0.0f, 0.0f}, 1.0f) > share) return x;
  }
  return 1.0f;
}

TEST(ShadowMap, LiesWhereTheLampPutsItAndIsSoftByItsHeight) {
  const TriangleMesh mesh = plate(0.1f);
  for (const float height : {0.05f, 0.2f}) {
    const double lamp = 0.1;  // rad
    ShadowMap map({&mesh}, {1.0, 0.0, 1.0}, lamp);
    map.draw(at_height(height), {});
    // A lamp at 45 degrees towards +x puts the shadow of the middle at x = -height.
    EXPECT_LT(map.lit({-height, 0, 0}, 1.0f), 0.05f);
    EXPECT_EQ(map.lit({0.5f, 0, 0}, 1.0f), 1.0f);
    EXPECT_NEAR(edge(map, 0.5f, -height), 0.1f, 0.006f) << height;
    // Across a plane at 45 degrees the half shadow is (distance along the ray) * lamp * sqrt 2 wide, at most 6 cm
    // in the lamp's frame.
    const float wide = edge(map, 0.95f, -height) - edge(map, 0.05f, -height);
    const auto expected = static_cast<float>(std::min(0.06, height * std::sqrt(2.0) * lamp) * std::sqrt(2.0));
    EXPECT_NEAR(wide, expected, 0.35f * expected) << height;
  }
}

TEST(ShadowMap, DoesNotShadeWhatCastsItEvenAtASlant) {
  const TriangleMesh mesh = plate(0.1f);
  for (const double slant : {0.0, 0.5, 1.0, 1.3}) {  // rad between lamp and normal
    ShadowMap map({&mesh}, {std::sin(slant), 0.0, std::cos(slant)}, 0.07);
    map.draw(at_height(0.0f), {});
    for (float x = -0.09f; x < 0.09f; x += 0.003f) {
      for (float y = -0.09f; y < 0.09f; y += 0.003f) {
        ASSERT_EQ(map.lit({x, y, 0.0f}, static_cast<float>(std::cos(slant))), 1.0f) << slant << ": " << x << " " << y;
      }
    }
  }
}

TEST(ShadowMap, OfNothingThereIsNone) {
  const TriangleMesh mesh = plate(0.1f);
  ShadowMap map({&mesh}, {0.0, 0.0, 1.0}, 0.07);
  map.draw(at_height(0.1f), std::vector<char>{1});
  EXPECT_EQ(map.lit({0, 0, 0}, 1.0f), 1.0f);
  map.draw(at_height(0.1f), std::vector<char>{0});
  EXPECT_EQ(map.lit({0, 0, 0}, 1.0f), 0.0f);
}

}  // namespace
}  // namespace bodyschema::simulator
