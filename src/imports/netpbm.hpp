#pragma once

#include <filesystem>

#include "bodyschema/geometry/image.hpp"

namespace bodyschema {

/// Reads a binary PPM (P6) or PGM (P5) picture of 8 bits a channel. Throws FileError naming the file
/// and what is wrong with it; sizes are checked against the file before memory is taken.
Image read_netpbm(const std::filesystem::path& file);

}  // namespace bodyschema
