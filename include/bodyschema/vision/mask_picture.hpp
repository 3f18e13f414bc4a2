#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "bodyschema/geometry/binary_mask.hpp"
#include "bodyschema/geometry/image.hpp"

namespace bodyschema {

/// Pictures of masks for people to look at. All writers create missing folders and throw FileError
/// when the file cannot be written.

/// White where set, black elsewhere, gray where not valid. `valid` may be empty.
void write_mask_png(const std::filesystem::path& file, const BinaryMask& mask,
                    const BinaryMask& valid = {});
/// The coverage as gray levels.
void write_coverage_png(const std::filesystem::path& file, int width, int height,
                        const std::vector<std::uint8_t>& coverage);
/// The picture with the mask's outline drawn in green and invalid pixels tinted red.
void write_overlay_png(const std::filesystem::path& file, const Image& image,
                       const BinaryMask& mask, const BinaryMask& valid = {});
/// A PNG, JPEG or PPM file as gray or RGB. Throws FileError.
Image read_picture(const std::filesystem::path& file);

}  // namespace bodyschema
