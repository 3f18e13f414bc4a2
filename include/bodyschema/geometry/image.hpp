#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace bodyschema {

/// An 8-bit picture: rows top to bottom, no padding, channels interleaved (1 gray, 3 RGB).
struct Image {
  int width = 0;
  int height = 0;
  int channels = 0;
  std::vector<std::uint8_t> data;

  Image() = default;
  Image(int image_width, int image_height, int image_channels)
      : width(image_width), height(image_height), channels(image_channels),
        data(static_cast<std::size_t>(image_width) * static_cast<std::size_t>(image_height) *
             static_cast<std::size_t>(image_channels)) {}

  [[nodiscard]] bool empty() const { return data.empty(); }
  [[nodiscard]] const std::uint8_t* pixel(int u, int v) const {
    return data.data() + (static_cast<std::size_t>(v) * static_cast<std::size_t>(width) + static_cast<std::size_t>(u)) *
                             static_cast<std::size_t>(channels);
  }
  [[nodiscard]] std::uint8_t* pixel(int u, int v) {
    return data.data() + (static_cast<std::size_t>(v) * static_cast<std::size_t>(width) + static_cast<std::size_t>(u)) *
                             static_cast<std::size_t>(channels);
  }
};

/// What a mask made by others holds, one of these a pixel: a gray picture.
inline constexpr std::uint8_t kMaskBackground = 0, kMaskUnknown = 128, kMaskRobot = 255;

}  // namespace bodyschema
