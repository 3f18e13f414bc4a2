#pragma once

#include <filesystem>

#include "bodyschema/geometry/image.hpp"

namespace bodyschema {

/// Reads a picture of a recording as gray or RGB: binary PPM or PGM, PNG or JPEG, told by its content.
/// Throws FileError naming the file and what is wrong with it; sizes are checked before memory for
/// pixels is taken, and a file cut short is an error.
Image read_picture_file(const std::filesystem::path& file);

}  // namespace bodyschema
