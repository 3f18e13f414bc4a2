#pragma once

#include <cstddef>
#include <string>

#include "bodyschema/geometry/triangle_mesh.hpp"

namespace bodyschema {

/// What a mesh's surface is like. A component is a set of triangles joined through edges that
/// exactly two of them share; one file often holds many that overlap.
struct MeshReport {
  std::size_t components = 0;
  std::size_t open_components = 0;
  std::size_t boundary_edges = 0;      ///< edges with an odd number of triangles
  std::size_t turned_triangles = 0;    ///< wound against their neighbours; turned round
  std::size_t turned_components = 0;   ///< closed but inside out; turned round
  std::size_t twisted_components = 0;  ///< no winding agrees everywhere (Moebius); left alone

  [[nodiscard]] bool closed() const { return boundary_edges == 0; }
  [[nodiscard]] bool consistent_winding() const { return twisted_components == 0; }
  /// One line without the part's name; empty when nothing is worth saying.
  [[nodiscard]] std::string text() const;
};

/// Makes vertices at most `tolerance_m` apart one, drops triangles that degenerate and vertices
/// that no triangle uses. The default is rounding of a float at arm's length; files hold finer detail
/// than a micrometre on purpose.
void weld(TriangleMesh& mesh, double tolerance_m = 1e-7);

/// Checks a welded mesh and turns what is wound the wrong way: first triangles against the majority
/// of their component, then closed components whose volume is negative, unless they lie inside
/// another closed component, where they are the wall of a cavity and right as they are. An open
/// component's outside cannot be told; it keeps the winding of its majority.
MeshReport check_and_orient(TriangleMesh& mesh);

}  // namespace bodyschema
