#pragma once

#include <cstddef>
#include <cstdint>

#include "bodyschema/geometry/image.hpp"
#include "bodyschema/geometry/pinhole.hpp"

namespace bodyschema {

/// By how much pictures of this size are reduced before they are looked at, along each axis: 1, 2, 4 or 8. They are
/// halved as long as both sides can be and twice the pixels of a 320x240 picture are left: outlines are measured to
/// some hundredths of these, and what a picture costs grows with its pixels. 640x480 and 960x540 stay as they are,
/// 1280x720 becomes 640x360.
[[nodiscard]] int picture_reduction(int width, int height);

/// The camera that sees the reduced pictures: each pixel stands for n x n of `camera`'s, whose sides n divides. Its
/// `reduction` grows by n.
[[nodiscard]] PinholeIntrinsics reduced(const PinholeIntrinsics& camera, int n);

/// Each pixel the mean of n x n, rounded.
/// @param rows  8-bit rows of width * channels, `stride` bytes apart; n divides width and height
/// @param out  its memory is used again
void reduce(const std::uint8_t* rows, std::size_t stride, int width, int height, int channels, int n, Image& out);
[[nodiscard]] Image reduced(const Image& image, int n);

}  // namespace bodyschema
