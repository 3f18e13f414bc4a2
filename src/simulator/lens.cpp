#include "bodyschema/simulator/lens.hpp"

#include <cmath>
#include <limits>

namespace bodyschema::simulator {
namespace {

/// The direction whose bent coordinates are `seen`.
Eigen::Vector2d straighten(const std::array<double, 5>& d, const Eigen::Vector2d& seen) {
  double x = seen.x();
  double y = seen.y();
  for (int i = 0; i < 8; ++i) {
    const double r2 = std::min(1.2, x * x + y * y);
    const double radial = 1.0 + r2 * (d[0] + r2 * (d[1] + r2 * d[4]));
    const double dx = 2.0 * d[2] * x * y + d[3] * (r2 + 2.0 * x * x);
    const double dy = d[2] * (r2 + 2.0 * y * y) + 2.0 * d[3] * x * y;
    x = (seen.x() - dx) / radial;
    y = (seen.y() - dy) / radial;
  }
  constexpr double kGoodEnough = 1e-5;  // normalised; some thousandths of a pixel
  if ((bend(d, x, y) - seen).norm() < kGoodEnough) return {x, y};
  // A lens that bends so much that the iteration above does not settle: halve the way along the ray instead. What
  // is tangential in the polynomial only moves the answer a little, and is put right from outside.
  Eigen::Vector2d aim = seen;
  Eigen::Vector2d found(x, y);
  for (int round = 0; round < 20; ++round) {
    const double length = aim.norm();
    if (length < 1e-12) break;
    const Eigen::Vector2d direction = aim / length;
    double near = 0.0;
    double far = 4.0;
    for (int i = 0; i < 50; ++i) {
      const double middle = 0.5 * (near + far);
      const Eigen::Vector2d p = middle * direction;
      (direction.dot(bend(d, p.x(), p.y())) < length ? near : far) = middle;
    }
    found = 0.5 * (near + far) * direction;
    const Eigen::Vector2d error = seen - bend(d, found.x(), found.y());
    if (error.norm() < kGoodEnough) break;
    aim += error;
  }
  return found;
}

}  // namespace

Eigen::Vector2d project(const CameraModel& camera, const Eigen::Vector3d& p_C) {
  if (p_C.z() < 1e-3) return {-1e6, -1e6};
  Eigen::Vector2d p(p_C.x() / p_C.z(), p_C.y() / p_C.z());
  if (camera.has_distortion()) p = bend(camera.distortion, p.x(), p.y());
  const auto& k = camera.intrinsics;
  return {k.fx * p.x() + k.cx, k.fy * p.y() + k.cy};
}

Lens::Lens(const CameraModel& camera) : camera_(camera) {
  const auto& k = camera_.intrinsics;
  rays_.reserve(static_cast<std::size_t>(k.width) * static_cast<std::size_t>(k.height));
  const bool distorted = camera_.has_distortion();
  for (int v = 0; v < k.height; ++v) {
    for (int u = 0; u < k.width; ++u) {
      Eigen::Vector3d ray = k.ray({u, v});
      if (distorted) ray.head<2>() = straighten(camera_.distortion, ray.head<2>());
      rays_.push_back(ray.cast<float>().normalized());
    }
  }
}

Lens::Extent Lens::extent(int v0, int v1) const {
  const auto& k = camera_.intrinsics;
  constexpr float kHuge = std::numeric_limits<float>::max();
  Extent e{kHuge, -kHuge, kHuge, -kHuge};
  const auto take = [&](int u, int v) {
    const Eigen::Vector3f& r = ray(u, v);
    const float x = r.x() / r.z();
    const float y = r.y() / r.z();
    e.x_min = std::min(e.x_min, x);
    e.x_max = std::max(e.x_max, x);
    e.y_min = std::min(e.y_min, y);
    e.y_max = std::max(e.y_max, y);
  };
  // A lens bends rows and columns, but not so that an inner pixel would look further out than all on the border.
  for (int u = 0; u < k.width; ++u) {
    take(u, v0);
    take(u, v1 - 1);
  }
  for (int v = v0; v < v1; ++v) {
    take(0, v);
    take(k.width - 1, v);
  }
  const float pixel = 2.0f / static_cast<float>(std::min(k.fx, k.fy));
  return {e.x_min - pixel, e.x_max + pixel, e.y_min - pixel, e.y_max + pixel};
}

}  // namespace bodyschema::simulator
