#include "colour_resolution.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace bodyschema {
namespace {

// Levels: what bends by less may be rounding.
constexpr float kRounding = 2.0f;
// Between a fifth and more than one.
constexpr float kLower = 0.5f;
// Levels that colours bend by over all pixels looked at; less says nothing.
constexpr float kLeast = 100.0f;

/// Brightness and both colour differences, as JPEG and video have them.
std::array<float, 3> parts(const std::uint8_t* pixel) {
  const auto red = static_cast<float>(pixel[0]), green = static_cast<float>(pixel[1]),
             blue = static_cast<float>(pixel[2]);
  const float brightness = 0.299f * red + 0.587f * green + 0.114f * blue;
  return {brightness, 0.564f * (blue - brightness), 0.713f * (red - brightness)};
}

}  // namespace

ColourResolution::Bend ColourResolution::bend_over(const Image& image, int distance, int every, int quarter) {
  Bend sum;
  const std::ptrdiff_t along_u = static_cast<std::ptrdiff_t>(distance) * image.channels,
                       along_v = along_u * image.width;
  for (int v = distance + quarter * every; v + distance < image.height; v += kQuarters * every) {
    for (int u = distance; u + distance < image.width; u += every) {
      const std::uint8_t* pixel = image.pixel(u, v);
      const auto here = parts(pixel);
      for (const std::ptrdiff_t step : {along_u, along_v}) {
        const auto before = parts(pixel - step), after = parts(pixel + step);
        const auto beyond_rounding = [&](std::size_t k) {
          return std::max(0.0f, std::abs(before[k] - 2.0f * here[k] + after[k]) - kRounding);
        };
        sum.brightness += beyond_rounding(0);
        sum.colour += std::max(beyond_rounding(1), beyond_rounding(2));
      }
    }
  }
  return sum;
}

bool ColourResolution::bleeds(const Image& image, int every) {
  constexpr int kNear_px = 1, kFar_px = 4;
  if (image.channels != 3) return false;
  const bool first = image.width != width_ || image.height != height_;
  width_ = image.width, height_ = image.height;
  for (int quarter = 0; quarter < kQuarters; ++quarter) {
    if (!first && quarter != next_) continue;
    of_[static_cast<std::size_t>(quarter)] = {bend_over(image, kNear_px, every, quarter),
                                              bend_over(image, kFar_px, every, quarter)};
  }
  next_ = (next_ + 1) % kQuarters;
  Bend near, far;
  for (const auto& quarter : of_) {
    near.brightness += quarter.near.brightness, near.colour += quarter.near.colour;
    far.brightness += quarter.far.brightness, far.colour += quarter.far.colour;
  }
  return far.colour > kLeast && near.colour * far.brightness < kLower * far.colour * near.brightness;
}

}  // namespace bodyschema
