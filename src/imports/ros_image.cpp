#include <algorithm>
#include <array>
#include <opencv2/imgproc.hpp>

#include "bodyschema/imports/ros_bag.hpp"
#include "picture_file.hpp"

namespace bodyschema {
namespace {

constexpr int kAsItIs = -1;

/// How pixels lie in memory and what turns them into gray or RGB.
struct Encoding {
  const char* name;
  int bytes_per_pixel;
  int conversion;  ///< of cv::cvtColor
};

// ROS names a Bayer pattern by its first two rows, OpenCV by the second row's second and third pixel.
constexpr std::array<Encoding, 16> kEncodings = {{{"mono8", 1, kAsItIs},
                                                  {"8UC1", 1, kAsItIs},
                                                  {"rgb8", 3, kAsItIs},
                                                  {"bgr8", 3, cv::COLOR_BGR2RGB},
                                                  {"8UC3", 3, cv::COLOR_BGR2RGB},
                                                  {"rgba8", 4, cv::COLOR_RGBA2RGB},
                                                  {"bgra8", 4, cv::COLOR_BGRA2RGB},
                                                  {"8UC4", 4, cv::COLOR_BGRA2RGB},
                                                  {"yuv422", 2, cv::COLOR_YUV2RGB_UYVY},
                                                  {"uyvy", 2, cv::COLOR_YUV2RGB_UYVY},
                                                  {"yuv422_yuy2", 2, cv::COLOR_YUV2RGB_YUY2},
                                                  {"yuyv", 2, cv::COLOR_YUV2RGB_YUY2},
                                                  {"bayer_rggb8", 1, cv::COLOR_BayerBG2RGB},
                                                  {"bayer_bggr8", 1, cv::COLOR_BayerRG2RGB},
                                                  {"bayer_gbrg8", 1, cv::COLOR_BayerGR2RGB},
                                                  {"bayer_grbg8", 1, cv::COLOR_BayerGB2RGB}}};

const Encoding* encoding_of(const std::string& name) {
  const auto found = std::find_if(kEncodings.begin(), kEncodings.end(), [&](const auto& e) { return name == e.name; });
  return found == kEncodings.end() ? nullptr : &*found;
}

}  // namespace

bool reads_ros_image(const std::string& encoding) {
  return encoding_of(encoding) != nullptr;
}

Image decode_ros_image(const std::string& name, std::int64_t width, std::int64_t height, std::int64_t step, Bytes data,
                       const std::string& where) {
  const Encoding* encoding = encoding_of(name);
  if (encoding == nullptr) {
    std::string known;
    for (const Encoding& e : kEncodings) known += std::string(known.empty() ? "" : ", ") + e.name;
    throw FileError(where + ": encoding '" + name.substr(0, 32) + "' cannot be read; expected one of " + known);
  }
  const std::string size = std::to_string(width) + "x" + std::to_string(height);
  if (width < 1 || height < 1 || width > kMaxSide_px || height > kMaxSide_px) {
    throw FileError(where + ": picture of " + size + " px; expected 1 to " + std::to_string(kMaxSide_px) + " a side");
  }
  const std::int64_t row = width * encoding->bytes_per_pixel;
  if (step == 0) step = row;  // as some publishers leave it
  const auto held = static_cast<std::int64_t>(data.size());
  if (step < row || step > held || held < step * (height - 1) + row) {
    throw FileError(where + ": " + std::to_string(held) + " bytes in rows of " + std::to_string(step) + " for " + size +
                    " px of " + name);
  }
  const bool halves = encoding->bytes_per_pixel == 2;
  const bool pattern = encoding->bytes_per_pixel == 1 && encoding->conversion != kAsItIs;
  if ((halves && width % 2 != 0) || (pattern && (width < 3 || height < 3))) {
    throw FileError(where + ": " + size + " px cannot be pictures of encoding " + name);
  }
  const cv::Mat raw(static_cast<int>(height), static_cast<int>(width), CV_8UC(encoding->bytes_per_pixel),
                    const_cast<std::uint8_t*>(data.data()), static_cast<std::size_t>(step));
  Image image(static_cast<int>(width), static_cast<int>(height),
              encoding->bytes_per_pixel == 1 && encoding->conversion == kAsItIs ? 1 : 3);
  cv::Mat out(image.height, image.width, CV_8UC(image.channels), image.data.data());
  if (encoding->conversion == kAsItIs) {
    raw.copyTo(out);
  } else {
    cv::cvtColor(raw, out, encoding->conversion);
  }
  return image;
}

}  // namespace bodyschema
