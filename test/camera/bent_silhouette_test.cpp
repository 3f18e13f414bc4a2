#include "bodyschema/camera/bent_silhouette.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace bodyschema {
namespace {

const PinholeIntrinsics kCamera{320, 240, 257.0, 257.0, 159.5, 119.5};

/// A disc about a pixel.
BinaryMask disc(double u0, double v0, double radius) {
  BinaryMask mask(kCamera.width, kCamera.height);
  for (int v = 0; v < mask.height(); ++v) {
    for (int u = 0; u < mask.width(); ++u) {
      if (std::hypot(u - u0, v - v0) < radius) mask.set(u, v);
    }
  }
  return mask;
}

Eigen::Vector2d centre(const BinaryMask& mask) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  double count = 0.0;
  for (int v = 0; v < mask.height(); ++v) {
    for (int u = 0; u < mask.width(); ++u) {
      if (!mask.at(u, v)) continue;
      sum += Eigen::Vector2d(u, v);
      count += 1.0;
    }
  }
  return sum / count;
}

TEST(BentSilhouette, LiesWhereTheLensPutsIt) {
  for (const double k1 : {-0.3, 0.2}) {
    const Eigen::Vector2d at(260.0, 60.0);
    const Eigen::Vector2d x((at.x() - kCamera.cx) / kCamera.fx, (at.y() - kCamera.cy) / kCamera.fy);
    const Eigen::Vector2d expected = (1.0 + k1 * x.squaredNorm()) * (at - Eigen::Vector2d(kCamera.cx, kCamera.cy)) +
                                     Eigen::Vector2d(kCamera.cx, kCamera.cy);
    EXPECT_GT((expected - at).norm(), 3.0);
    EXPECT_LT((centre(bent_silhouette(disc(at.x(), at.y(), 6.0), kCamera, k1)) - expected).norm(), 0.5) << k1;
  }
}

/// Every pixel from where the lens has it, by itself.
BinaryMask pixel_by_pixel(const BinaryMask& straight, double k1) {
  BinaryMask bent(straight.width(), straight.height());
  for (int v = 0; v < bent.height(); ++v) {
    for (int u = 0; u < bent.width(); ++u) {
      const Eigen::Vector2d seen((u - kCamera.cx) / kCamera.fx, (v - kCamera.cy) / kCamera.fy);
      Eigen::Vector2d x = seen;
      for (int i = 0; i < 5; ++i) x = seen / (1.0 + k1 * x.squaredNorm());
      const auto su = static_cast<int>(std::lround(kCamera.fx * x.x() + kCamera.cx));
      const auto sv = static_cast<int>(std::lround(kCamera.fy * x.y() + kCamera.cy));
      if (su >= 0 && sv >= 0 && su < bent.width() && sv < bent.height() && straight.at(su, sv)) bent.set(u, v);
    }
  }
  return bent;
}

// What lies away from outlines is not looked at pixel by pixel.
TEST(BentSilhouette, EveryPixelIsWhatTheLensHasThere) {
  for (const double k1 : {-0.2, -0.05, 0.03, 0.2}) {
    for (const double radius : {3.0, 40.0, 110.0, 190.0}) {
      for (const auto& [u, v] : {std::pair{160.0, 120.0}, {10.0, 30.0}, {319.0, 239.0}}) {
        const auto straight = disc(u, v, radius);
        EXPECT_EQ(bent_silhouette(straight, kCamera, k1), pixel_by_pixel(straight, k1)) << k1 << ", " << radius;
      }
    }
  }
}

TEST(BentSilhouette, OfALensThatHardlyBendsIsTheSame) {
  const auto mask = disc(300.0, 220.0, 10.0);
  EXPECT_EQ(bent_silhouette(mask, kCamera, 0.003), mask);
}

}  // namespace
}  // namespace bodyschema
