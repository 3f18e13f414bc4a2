#include "bodyschema/core/user_cache.hpp"

#include <spdlog/spdlog.h>

#include <cstdlib>
#include <exception>
#include <fstream>
#include <iterator>

#include "bodyschema/core/write_file.hpp"

namespace bodyschema {

std::filesystem::path user_cache_folder() {
  // Relative paths are invalid there (XDG Base Directory Specification).
  if (const char* cache = std::getenv("XDG_CACHE_HOME"); cache != nullptr && *cache == '/') {
    return std::filesystem::path(cache) / "bodyschema";
  }
  if (const char* home = std::getenv("HOME"); home != nullptr && *home == '/') {
    return std::filesystem::path(home) / ".cache" / "bodyschema";
  }
  return {};
}

std::optional<std::string> read_cache(const std::filesystem::path& name) {
  const auto folder = user_cache_folder();
  if (folder.empty()) return std::nullopt;
  std::ifstream file(folder / name, std::ios::binary);
  if (!file) return std::nullopt;
  std::string bytes((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  return file.bad() ? std::nullopt : std::optional(std::move(bytes));
}

void write_cache(const std::filesystem::path& name, std::string_view bytes) {
  const auto folder = user_cache_folder();
  if (folder.empty()) return;
  try {
    const auto file = folder / name;
    make_folder(file.parent_path());
    replace_file(file, bytes);
  } catch (const std::exception& error) {
    spdlog::debug("not cached: {}", error.what());
  }
}

}  // namespace bodyschema
