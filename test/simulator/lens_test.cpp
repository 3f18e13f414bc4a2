#include "bodyschema/simulator/lens.hpp"

#include <gtest/gtest.h>

namespace bodyschema::simulator {
namespace {

CameraModel camera(const std::array<double, 5>& distortion) {
  CameraModel c;
  c.intrinsics = {320, 240, 257.0, 259.0, 158.0, 121.0};
  c.distortion = distortion;
  return c;
}

TEST(Lens, RaysAreWhatTheirPixelsShow) {
  // The strong ones fold back outside the picture: a ray must still be found, to a hundredth of a pixel.
  for (const auto& d : {std::array<double, 5>{}, std::array<double, 5>{-0.1, 0.02, 0.001, -0.002, 0.0},
                        std::array<double, 5>{-0.3, 0, 0, 0, 0}, std::array<double, 5>{0.3, 0, 0, 0, 0},
                        std::array<double, 5>{-0.3, 0.1, 0.002, 0.001, 0.01}}) {
    const Lens lens(camera(d));
    double worst = 0.0;
    for (int v = 0; v < 240; v += 7) {
      for (int u = 0; u < 320; u += 7) {
        EXPECT_NEAR(lens.ray(u, v).norm(), 1.0, 1e-5);
        const Eigen::Vector2d pixel = project(lens.camera(), lens.ray(u, v).cast<double>());
        worst = std::max(worst, (pixel - Eigen::Vector2d(u, v)).norm());
      }
    }
    EXPECT_LT(worst, 0.05) << "k1 = " << d[0];
  }
}

TEST(Lens, ABarrelPullsCornersInwards) {
  const auto straight = project(camera({}), {0.4, 0.3, 1.0});
  const auto barrel = project(camera({-0.3, 0, 0, 0, 0}), {0.4, 0.3, 1.0});
  const Eigen::Vector2d middle(158.0, 121.0);
  EXPECT_NEAR((barrel - middle).norm() / (straight - middle).norm(), 1.0 - 0.3 * 0.25, 1e-9);
}

TEST(Lens, ExtentHoldsEveryRayOfItsRows) {
  const Lens lens(camera({-0.3, 0.05, 0.002, 0.001, 0.0}));
  const auto e = lens.extent(100, 140);
  for (int v = 100; v < 140; ++v) {
    for (int u = 0; u < 320; ++u) {
      const Eigen::Vector3f& r = lens.ray(u, v);
      EXPECT_TRUE(r.x() / r.z() >= e.x_min && r.x() / r.z() <= e.x_max && r.y() / r.z() >= e.y_min &&
                  r.y() / r.z() <= e.y_max)
          << u << " " << v;
    }
  }
  EXPECT_GT(e.y_max - e.y_min, 0.0f);
  EXPECT_LT(e.y_max - e.y_min, 0.35f);  // a band, not the picture
}

}  // namespace
}  // namespace bodyschema::simulator
