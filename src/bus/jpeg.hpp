#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "bodyschema/bus/messages.hpp"

namespace bodyschema {

/// Decompresses a whole JPEG file of exactly this size to gray or RGB. The file's own size is read
/// and compared before any memory for pixels is taken; whatever libjpeg doubts (an early end, bad
/// codes) is an error, because a half-decoded picture would look like a good one.
///
/// libjpeg-turbo through libjpeg's interface, not TurboJPEG's: that one cannot tell bytes between segments, which some
/// cameras send, from damage.
/// @param reduction  1, 2, 4 or 8, dividing both sides: the picture comes out reduced (picture_reduction), from the
///   frequencies that are left, which takes less time than all of them
DecodeResult decompress_jpeg(Bytes file, int width, int height, int reduction, Image& out);

/// Compresses a gray or RGB picture. @param quality  1 to 100. Throws DataError when it is neither.
std::vector<std::uint8_t> compress_jpeg(const Image& image, int quality);

}  // namespace bodyschema
