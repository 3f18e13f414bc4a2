#pragma once

#include <filesystem>

#include "bodyschema/geometry/triangle_mesh.hpp"

namespace bodyschema {

/// Triangles of a mesh file, in the file's own axes and metres, the way URDF readers take it: every
/// node transform and COLLADA's length unit apply, COLLADA's up-axis does not (URDF frames have no
/// "up"). Vertices are as stored: not welded. Polygons are cut into triangles, lines and points
/// dropped. Nothing but `file` itself is opened (no material libraries).
///
/// Throws FileError naming the file when its extension is not .dae, .stl or .obj (any case), it is
/// larger than 256 MiB, broken, has no triangles, more than 4 million, or non-finite vertices.
TriangleMesh read_mesh_file(const std::filesystem::path& file);

}  // namespace bodyschema
