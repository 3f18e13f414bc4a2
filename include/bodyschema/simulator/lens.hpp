#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <vector>

#include "bodyschema/camera/stereo_rig.hpp"

namespace bodyschema::simulator {

/// Where a lens puts a direction: Brown and Conrady's polynomial (k1 k2 p1 p2 k3 as OpenCV) of the normalised
/// coordinates x / z, y / z. Far outside of what a lens can see the polynomial folds back; beyond a radius of 1.1
/// it goes on with the scale that it has there.
template <class Number>
Eigen::Vector2d bend(const std::array<double, 5>& d, Number x, Number y) {
  const double r2 = std::min(1.2, static_cast<double>(x) * x + static_cast<double>(y) * y);
  const double radial = 1.0 + r2 * (d[0] + r2 * (d[1] + r2 * d[4]));
  const double dx = 2.0 * d[2] * x * y + d[3] * (r2 + 2.0 * x * x);
  const double dy = d[2] * (r2 + 2.0 * y * y) + 2.0 * d[3] * x * y;
  return {x * radial + dx, y * radial + dy};
}

/// A camera's pixel of a point, metres in the camera's frame; far outside of every picture for a point that is not
/// in front of it.
Eigen::Vector2d project(const CameraModel& camera, const Eigen::Vector3d& p_C);

/// A camera with the viewing direction of every pixel's centre, worked out once. Immutable.
class Lens {
 public:
  explicit Lens(const CameraModel& camera);

  [[nodiscard]] const CameraModel& camera() const { return camera_; }
  /// Unit length, camera frame.
  [[nodiscard]] const Eigen::Vector3f& ray(int u, int v) const {
    return rays_[static_cast<std::size_t>(v) * static_cast<std::size_t>(camera_.intrinsics.width) +
                 static_cast<std::size_t>(u)];
  }
  /// Normalised coordinates that rows [v0, v1) can show, one pixel of margin included.
  struct Extent {
    float x_min, x_max, y_min, y_max;
  };
  [[nodiscard]] Extent extent(int v0, int v1) const;

 private:
  CameraModel camera_;
  std::vector<Eigen::Vector3f> rays_;
};

}  // namespace bodyschema::simulator
