#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <vector>

#include "bodyschema/core/picture_size.hpp"
#include "bodyschema/geometry/binary_mask.hpp"
#include "bodyschema/geometry/image.hpp"

namespace bodyschema {

/// Pictures of masks for people to look at. All writers create missing folders and throw FileError
/// when the file cannot be written.

/// White where set, black elsewhere, gray where not valid. `valid` may be empty.
void write_mask_png(const std::filesystem::path& file, const BinaryMask& mask, const BinaryMask& valid = {});
/// The coverage as gray levels.
void write_coverage_png(const std::filesystem::path& file, int width, int height,
                        const std::vector<std::uint8_t>& coverage);
/// The picture with the mask's outline drawn in green and invalid pixels tinted red.
void write_overlay_png(const std::filesystem::path& file, const Image& image, const BinaryMask& mask,
                       const BinaryMask& valid = {});
/// A PNG, JPEG, PPM or PGM file of at most 64 MiB and 16384 px a side as gray or RGB. `check_size` may throw on
/// account of what the header says, before memory for pixels is taken. Throws FileError.
Image read_picture(const std::filesystem::path& file, const std::function<void(PictureSize)>& check_size = {});

}  // namespace bodyschema
