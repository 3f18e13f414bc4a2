#pragma once

#include <filesystem>
#include <functional>

#include "bodyschema/core/picture_size.hpp"
#include "bodyschema/geometry/binary_mask.hpp"
#include "bodyschema/geometry/image.hpp"

namespace bodyschema {

/// A mask as a picture: white where set, black elsewhere, gray where not valid. Creates missing folders.
/// @param valid  may be empty
/// @param n  each pixel of the mask is n x n of the file: PinholeIntrinsics::reduction gives it the size of
///           the camera's own pictures
/// Throws as write_file (core/write_file.hpp), FileError for another ending than a picture's.
void write_mask_png(const std::filesystem::path& file, const BinaryMask& mask, const BinaryMask& valid = {}, int n = 1);

/// A PNG, JPEG, PPM or PGM file of at most 64 MiB and 16384 px a side as gray or RGB. `check_size` may throw on
/// account of what the header says, before memory for pixels is taken. Throws FileError.
Image read_picture(const std::filesystem::path& file, const std::function<void(PictureSize)>& check_size = {});

}  // namespace bodyschema
