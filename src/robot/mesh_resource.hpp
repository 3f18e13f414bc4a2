#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace bodyschema {

/// The file that a URDF means by a mesh's `filename`: `package://name/rest` and `model://name/rest`
/// as root/name/rest under each search root, anything else beside the URDF and then under each
/// search root; `file://` is dropped. The first that exists wins.
///
/// The path, `..` and symbolic links resolved, must lie in the URDF's folder or in a search root (so a
/// URDF cannot name any file of the machine; a path like ../meshes/a.stl needs the folder above as a
/// root, and a workspace of links, as `colcon build --symlink-install` makes, the folder they lead to).
///
/// @param where  names the URDF and link in errors. Throws FileError listing the places tried.
std::filesystem::path resolve_mesh(const std::string& filename, const std::string& where,
                                   const std::filesystem::path& urdf_directory,
                                   const std::vector<std::filesystem::path>& search_roots);

}  // namespace bodyschema
