#pragma once

#include <Eigen/Core>
#include <cmath>

namespace bodyschema {

/// A pinhole camera without distortion.
///
/// Pixel convention, stated here once for the whole project: OpenCV's. The centre of the top-left
/// pixel is (0, 0), x runs right, y runs down; pixel (column u, row v) covers
/// [u-0.5, u+0.5) x [v-0.5, v+0.5). A silhouette contains a pixel when its centre is covered.
/// OpenGL window coordinates have that centre at (0.5, 0.5).
struct PinholeIntrinsics {
  int width = 0;    ///< px
  int height = 0;   ///< px
  double fx = 0.0;  ///< px
  double fy = 0.0;  ///< px
  double cx = 0.0;  ///< px, OpenCV convention
  double cy = 0.0;  ///< px, OpenCV convention
  /// So many pixels of the camera's own pictures, along each axis, are one pixel here.
  int reduction = 1;

  /// Projects a point in camera coordinates (metres, z > 0) to pixels.
  [[nodiscard]] Eigen::Vector2d project(const Eigen::Vector3d& p_C) const {
    return {fx * p_C.x() / p_C.z() + cx, fy * p_C.y() / p_C.z() + cy};
  }
  /// The viewing direction of a pixel, scaled to z = 1.
  [[nodiscard]] Eigen::Vector3d ray(const Eigen::Vector2d& pixel) const {
    return {(pixel.x() - cx) / fx, (pixel.y() - cy) / fy, 1.0};
  }
  friend bool operator==(const PinholeIntrinsics&, const PinholeIntrinsics&) = default;
};

/// The length in a picture that one pixel of a 320x240 picture has: settings in px are multiplied by it.
inline double picture_unit(int width, int height) {
  return std::sqrt(static_cast<double>(width) * height / (320.0 * 240.0));
}
inline double picture_unit(const PinholeIntrinsics& camera) {
  return picture_unit(camera.width, camera.height);
}

}  // namespace bodyschema
