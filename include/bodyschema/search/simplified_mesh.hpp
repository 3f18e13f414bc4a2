#pragma once

#include "bodyschema/geometry/triangle_mesh.hpp"

namespace bodyschema {

/// A mesh of fewer triangles with the same silhouettes: seen from any of 24 directions all around, its outline lies on
/// average no further than `bound_m` from that of `mesh` (the area between the two over the outline's length), so that
/// at a depth z a camera of focal length f sees it moved by f * bound_m / z px. Where no such mesh is found, or there
/// is little to save, or meshoptimizer was not there to build with, it comes back as it is.
///
/// The result is kept in the user's cache (core/user_cache.hpp), by what the mesh and the bound are.
TriangleMesh simplified_mesh(const TriangleMesh& mesh, double bound_m);

}  // namespace bodyschema
