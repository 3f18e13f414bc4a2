#pragma once

#include <cstdint>
#include <filesystem>

namespace bodyschema {

/// The size of a file in bytes, before memory is taken for it.
/// Throws FileError naming file, size and limit when it is larger, or when it cannot be told.
std::uintmax_t file_size_at_most(const std::filesystem::path& file, std::uintmax_t bytes);

}  // namespace bodyschema
