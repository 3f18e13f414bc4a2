#include "bodyschema/camera/picture_reduction.hpp"

#include <opencv2/imgproc.hpp>

namespace bodyschema {

int picture_reduction(int width, int height) {
  constexpr std::int64_t kFewestPixels = 2 * 320 * 240;
  constexpr int kMost = 8;  // what a JPEG can be decoded at
  int n = 1;
  const auto can_be_halved = [&] {
    const int next = 2 * n;
    return next <= kMost && width % next == 0 && height % next == 0 &&
           std::int64_t{width / next} * (height / next) >= kFewestPixels;
  };
  while (can_be_halved()) n *= 2;
  return n;
}

PinholeIntrinsics reduced(const PinholeIntrinsics& camera, int n) {
  const double first = 0.5 * (n - 1);  // the middle of the first n pixels
  return {camera.width / n,        camera.height / n,       camera.fx / n,       camera.fy / n,
          (camera.cx - first) / n, (camera.cy - first) / n, camera.reduction * n};
}

void reduce(const std::uint8_t* rows, std::size_t stride, int width, int height, int channels, int n, Image& out) {
  out.width = width / n;
  out.height = height / n;
  out.channels = channels;
  out.data.resize(static_cast<std::size_t>(out.width) * static_cast<std::size_t>(out.height) *
                  static_cast<std::size_t>(channels));
  // OpenCV's headers know no picture that is only read.
  const cv::Mat from(height, width, CV_8UC(channels), const_cast<std::uint8_t*>(rows), stride);
  cv::Mat to(out.height, out.width, CV_8UC(channels), out.data.data());
  cv::resize(from, to, to.size(), 0.0, 0.0, cv::INTER_AREA);
}

Image reduced(const Image& image, int n) {
  Image out;
  reduce(image.data.data(), static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.channels),
         image.width, image.height, image.channels, n, out);
  return out;
}

}  // namespace bodyschema
