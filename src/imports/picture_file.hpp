#pragma once

#include <cstdint>
#include <filesystem>
#include <span>

#include "bodyschema/geometry/image.hpp"

namespace bodyschema {

/// Of a side of a picture: MessageLimits as shipped, which refuse what is larger where the log is played.
inline constexpr int kMaxSide_px = 4096;

/// Reads a picture of a recording as gray or RGB: binary PPM or PGM, PNG or JPEG, told by its content.
/// Throws FileError naming the file and what is wrong with it; sizes are checked before memory for
/// pixels is taken, and a file cut short is an error.
Image read_picture_file(const std::filesystem::path& file);

/// The same for a mask. One that is drawn in a PNG's alpha channel, over one colour, is read from there; where colours
/// and alpha say different things, FileError.
Image read_mask_file(const std::filesystem::path& file);

/// The same for the bytes of a PNG or JPEG file. @param where  begins the error
Image read_picture(std::span<const std::uint8_t> bytes, const std::filesystem::path& where);
/// Whether a file of these bytes would be a JPEG.
bool is_jpeg(std::span<const std::uint8_t> bytes);

}  // namespace bodyschema
