#include "mesh_resource.hpp"

#include <algorithm>

#include "bodyschema/core/error.hpp"

namespace bodyschema {
namespace {

namespace fs = std::filesystem;

/// Where a path leads, links followed as far as it exists.
fs::path real(const fs::path& path) {
  std::error_code error;
  fs::path found = fs::weakly_canonical(fs::absolute(path), error);
  // A link that leads in a circle leads nowhere.
  if (error) found = fs::absolute(path).lexically_normal();
  return found.has_filename() ? found : found.parent_path();  // no trailing slash
}

bool lies_in(const fs::path& path, const fs::path& root) {
  return std::mismatch(root.begin(), root.end(), path.begin(), path.end()).first == root.end();
}

bool drop_prefix(std::string& text, const std::string& prefix) {
  if (text.rfind(prefix, 0) != 0) return false;
  text.erase(0, prefix.size());
  return true;
}

}  // namespace

fs::path resolve_mesh(const std::string& filename, const std::string& where, const fs::path& urdf_directory,
                      const std::vector<fs::path>& search_roots) {
  std::vector<fs::path> roots;
  for (const auto& root : search_roots) roots.push_back(real(root));
  std::vector<fs::path> bases = roots;
  roots.insert(roots.begin(), real(urdf_directory));

  std::string rest = filename;
  const bool package = drop_prefix(rest, "package://") || drop_prefix(rest, "model://");
  if (!package) {
    drop_prefix(rest, "file://");
    bases.insert(bases.begin(), roots.front());
  }
  if (package && bases.empty()) {
    throw FileError(where + ": mesh '" + filename + "' needs an entry in mesh_search_roots: the folder that holds '" +
                    rest.substr(0, rest.find('/')) + "/'");
  }

  std::string tried;
  bool escaped = false;
  std::string outside;  // the folder of a mesh that is there
  for (const auto& base : bases) {
    const fs::path candidate = real(base / rest);  // an absolute `rest` replaces base
    if (std::none_of(roots.begin(), roots.end(), [&](const fs::path& root) { return lies_in(candidate, root); })) {
      escaped = true;
      std::error_code unreadable;
      if (fs::is_regular_file(candidate, unreadable)) outside = candidate.parent_path().string();
      continue;
    }
    std::error_code error;
    if (fs::is_regular_file(candidate, error)) return candidate;
    tried += (tried.empty() ? "" : ", ") + candidate.string();
  }
  if (tried.empty() && escaped) {
    throw FileError(where + ": mesh '" + filename + "' leads outside the URDF's folder and mesh_search_roots" +
                    (outside.empty() ? "" : "; allow its place with robot.mesh_search_roots: [" + outside + "]"));
  }
  throw FileError(where + ": mesh '" + filename + "' not found; tried " + tried);
}

}  // namespace bodyschema
