#pragma once

#include <algorithm>
#include <cstdint>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "bodyschema/geometry/image.hpp"

namespace bodyschema::test {

/// Through JPEG and back.
inline Image compressed(Image image, int quality) {
  cv::Mat bgr, back;
  cv::cvtColor(cv::Mat(image.height, image.width, CV_8UC3, image.data.data()), bgr, cv::COLOR_RGB2BGR);
  std::vector<std::uint8_t> file;
  cv::imencode(".jpg", bgr, file, {cv::IMWRITE_JPEG_QUALITY, quality});
  cv::cvtColor(cv::imdecode(file, cv::IMREAD_COLOR), back, cv::COLOR_BGR2RGB);
  std::copy(back.data, back.data + image.data.size(), image.data.begin());
  return image;
}

}  // namespace bodyschema::test
