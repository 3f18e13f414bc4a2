#include "bodyschema/core/installation.hpp"

#include <cstdlib>
#include <system_error>

namespace bodyschema {
namespace {

namespace fs = std::filesystem;

bool holds_our_data(const fs::path& directory) {
  std::error_code ignored;
  return fs::is_directory(directory / "config", ignored) && fs::is_directory(directory / "meshes", ignored);
}

}  // namespace

fs::path data_directory_of(const fs::path& executable) {
  const fs::path bin = executable.parent_path();
  const fs::path installed = (bin / ".." / "share" / "bodyschema").lexically_normal();
  if (holds_our_data(installed)) {
    return installed;
  }
  // In a build tree: build/<preset>/bin inside the sources, or a build folder beside or below them.
  for (fs::path directory = bin; directory != directory.root_path(); directory = directory.parent_path()) {
    if (holds_our_data(directory)) {
      return directory;
    }
  }
  return {};
}

fs::path data_directory() {
  if (const char* share = std::getenv("BODYSCHEMA_SHARE"); share != nullptr && *share != '\0') {
    return share;
  }
  std::error_code error;
  const fs::path executable = fs::read_symlink("/proc/self/exe", error);
  return error ? fs::path{} : data_directory_of(executable);
}

fs::path find_data_file(const fs::path& path) {
  std::error_code ignored;
  if (path.is_absolute() || fs::exists(path, ignored)) {
    return path;
  }
  const fs::path candidate = data_directory() / path;
  return fs::exists(candidate, ignored) ? candidate : path;
}

}  // namespace bodyschema
