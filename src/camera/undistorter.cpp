#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "bodyschema/camera/stereo_rig.hpp"
#include "bodyschema/core/error.hpp"

namespace bodyschema {

Undistorter::Undistorter(const CameraModel& camera) : camera_(camera) {
  if (!camera.has_distortion()) return;
  const PinholeIntrinsics& k = camera.intrinsics;
  const cv::Matx33d K(k.fx, 0, k.cx, 0, k.fy, k.cy, 0, 0, 1);
  const cv::Mat D(1, static_cast<int>(camera.distortion.size()), CV_64F, const_cast<double*>(camera.distortion.data()));
  cv::Mat x, y;
  cv::initUndistortRectifyMap(K, D, cv::noArray(), K, {k.width, k.height}, CV_32FC1, x, y);
  map_x_.assign(x.ptr<float>(), x.ptr<float>() + x.total());
  map_y_.assign(y.ptr<float>(), y.ptr<float>() + y.total());
}

Image Undistorter::apply(const Image& image) const {
  const PinholeIntrinsics& k = camera_.intrinsics;
  if (image.width != k.width || image.height != k.height) {
    throw DataError("camera '" + camera_.name + "': picture of " + std::to_string(image.width) + "x" +
                    std::to_string(image.height) + " px, " + std::to_string(k.width) + "x" + std::to_string(k.height) +
                    " expected");
  }
  if (map_x_.empty()) return image;
  Image straight(image.width, image.height, image.channels);
  const cv::Mat source(image.height, image.width, CV_8UC(image.channels), const_cast<std::uint8_t*>(image.data.data()));
  cv::Mat target(image.height, image.width, CV_8UC(image.channels), straight.data.data());
  const cv::Mat x(k.height, k.width, CV_32FC1, const_cast<float*>(map_x_.data()));
  const cv::Mat y(k.height, k.width, CV_32FC1, const_cast<float*>(map_y_.data()));
  cv::remap(source, target, x, y, cv::INTER_LINEAR, cv::BORDER_REFLECT_101);
  return straight;
}

BinaryMask Undistorter::valid() const {
  const PinholeIntrinsics& k = camera_.intrinsics;
  BinaryMask mask(k.width, k.height);
  if (map_x_.empty()) {
    mask.fill(true);
    return mask;
  }
  for (int v = 0; v < k.height; ++v) {
    for (int u = 0; u < k.width; ++u) {
      const auto i = static_cast<std::size_t>(v) * static_cast<std::size_t>(k.width) + static_cast<std::size_t>(u);
      const bool seen = map_x_[i] >= 0.0f && map_x_[i] <= static_cast<float>(k.width - 1) && map_y_[i] >= 0.0f &&
                        map_y_[i] <= static_cast<float>(k.height - 1);
      mask.set(u, v, seen);
    }
  }
  return mask;
}

}  // namespace bodyschema
