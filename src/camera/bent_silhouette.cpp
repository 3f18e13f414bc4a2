#include "bodyschema/camera/bent_silhouette.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

namespace bodyschema {
namespace {

/// How far the lens moves the picture's furthest corner, px.
double furthest_px(const PinholeIntrinsics& k, double k1) {
  const double x = std::max(k.cx, k.width - 1 - k.cx) / k.fx, y = std::max(k.cy, k.height - 1 - k.cy) / k.fy;
  const double r = std::hypot(x, y);
  return std::abs(k1) * r * r * r * std::max(k.fx, k.fy);
}

}  // namespace

BinaryMask bent_silhouette(BinaryMask straight, const PinholeIntrinsics& k, double k1) {
  constexpr double kSame_px = 0.5;
  if (furthest_px(k, k1) < kSame_px) return straight;
  constexpr int kIterations = 5;  // each leaves a fifth or less of the error, up to |k1| r^2 = 0.2
  BinaryMask result(straight.width(), straight.height());
  for (int v = 0; v < straight.height(); ++v) {
    for (int u = 0; u < straight.width(); ++u) {
      const Eigen::Vector2d seen((u - k.cx) / k.fx, (v - k.cy) / k.fy);
      Eigen::Vector2d x = seen;
      for (int i = 0; i < kIterations; ++i) x = seen / (1.0 + k1 * x.squaredNorm());
      const auto su = static_cast<int>(std::lround(k.fx * x.x() + k.cx));
      const auto sv = static_cast<int>(std::lround(k.fy * x.y() + k.cy));
      const bool inside = su >= 0 && sv >= 0 && su < straight.width() && sv < straight.height();
      if (inside && straight.at(su, sv)) result.set(u, v);
    }
  }
  return result;
}

}  // namespace bodyschema
