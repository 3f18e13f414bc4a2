#pragma once

#include <Eigen/Core>

#include "bodyschema/geometry/triangle_mesh.hpp"

namespace bodyschema {

/// URDF's primitives as closed meshes wound outward, metres, centred on the origin. Round ones are
/// inscribed polyhedra, at most 0.25 % of the radius inside the true surface.

TriangleMesh box_mesh(const Eigen::Vector3d& size_m);
/// Axis along z.
TriangleMesh cylinder_mesh(double radius_m, double length_m);
TriangleMesh sphere_mesh(double radius_m);

}  // namespace bodyschema
