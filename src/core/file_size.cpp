#include "bodyschema/core/file_size.hpp"

#include <string>
#include <system_error>

#include "bodyschema/core/error.hpp"

namespace bodyschema {

std::uintmax_t file_size_at_most(const std::filesystem::path& file, std::uintmax_t bytes) {
  std::error_code error;
  const auto size = std::filesystem::file_size(file, error);
  if (error) throw FileError(file.string() + ": cannot be read: " + error.message());
  if (size > bytes) {
    throw FileError(file.string() + ": " + std::to_string(size) + " bytes, at most " + std::to_string(bytes) +
                    " expected");
  }
  return size;
}

}  // namespace bodyschema
