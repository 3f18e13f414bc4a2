#pragma once

#include <Eigen/Core>
#include <vector>

#include "bodyschema/geometry/triangle_mesh.hpp"
#include "bodyschema/simulator/rasterizer.hpp"

/// Surfaces of everyday things, made of triangles that face outwards. Metres.
namespace bodyschema::simulator::shapes {

/// Centred on the origin, edges along the axes.
TriangleMesh box(const Eigen::Vector3f& size);
/// A table's top: as box, its upper face (z = size.z / 2) in squares of at most `square` so that a lens bends it.
TriangleMesh slab(const Eigen::Vector3f& size, float square);
/// A turned piece around the z axis. @param profile  (radius, z) from bottom to top; radius 0 closes an end
TriangleMesh turned(const std::vector<Eigen::Vector2f>& profile, int segments = 28);
/// A rod with round ends from a to b, thicker at one end perhaps.
TriangleMesh rod(const Eigen::Vector3f& a, const Eigen::Vector3f& b, float radius_a, float radius_b, int segments = 20);
/// An ellipsoid centred on the origin.
TriangleMesh ellipsoid(const Eigen::Vector3f& radii, int segments = 20);

/// The mesh moved.
TriangleMesh moved(TriangleMesh mesh, const Eigen::Isometry3f& X);
/// The mesh in a mirror across its plane x = 0.
TriangleMesh mirrored(TriangleMesh mesh);
/// Every face moved along its normal by `distance` (negative: inwards); vertices go where their faces meet then.
TriangleMesh dilated(const TriangleMesh& mesh, float distance);
/// The mesh without detail finer than `cell`: its vertices that lie in one cell of a grid become one. Which triangle
/// of the mesh each triangle was is told in `source`, if given.
TriangleMesh coarse(const TriangleMesh& mesh, float cell, std::vector<std::size_t>* source = nullptr);
/// Adds a mesh in one paint to a part.
void add(PaintedPart& part, const TriangleMesh& mesh, const Paint& paint);

}  // namespace bodyschema::simulator::shapes
