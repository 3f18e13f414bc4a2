#pragma once

#include <filesystem>
#include <functional>

#include "bodyschema/core/picture_size.hpp"
#include "bodyschema/geometry/binary_mask.hpp"
#include "bodyschema/geometry/image.hpp"

namespace bodyschema {

/// A mask for people to look at: white where set, black elsewhere, gray where not valid. `valid` may be empty. Creates
/// missing folders. Throws as write_file (core/write_file.hpp), FileError for another ending than a picture's.
void write_mask_png(const std::filesystem::path& file, const BinaryMask& mask, const BinaryMask& valid = {});
/// A PNG, JPEG, PPM or PGM file of at most 64 MiB and 16384 px a side as gray or RGB. `check_size` may throw on
/// account of what the header says, before memory for pixels is taken. Throws FileError.
Image read_picture(const std::filesystem::path& file, const std::function<void(PictureSize)>& check_size = {});

}  // namespace bodyschema
