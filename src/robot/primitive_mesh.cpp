#include "primitive_mesh.hpp"

#include <cmath>

#include "bodyschema/geometry/pose.hpp"

namespace bodyschema {
namespace {

constexpr std::uint32_t kSegments = 48;  // around; 1 - cos(pi / 48) = 0.2 % of the radius
constexpr std::uint32_t kRings = 24;     // from pole to pole

/// A surface of revolution about z from (radius, z) pairs, bottom to top, closed by a pole vertex
/// at either end.
TriangleMesh lathe(const std::vector<Eigen::Vector2d>& profile, double bottom_z, double top_z) {
  TriangleMesh mesh;
  for (const auto& ring : profile) {
    for (std::uint32_t s = 0; s < kSegments; ++s) {
      const double angle = 2.0 * kPi * s / kSegments;
      mesh.vertices.push_back(
          Eigen::Vector3d(ring.x() * std::cos(angle), ring.x() * std::sin(angle), ring.y()).cast<float>());
    }
  }
  const auto bottom = static_cast<std::uint32_t>(mesh.vertices.size());
  const std::uint32_t top = bottom + 1;
  mesh.vertices.emplace_back(0.f, 0.f, static_cast<float>(bottom_z));
  mesh.vertices.emplace_back(0.f, 0.f, static_cast<float>(top_z));
  const auto rings = static_cast<std::uint32_t>(profile.size());
  for (std::uint32_t s = 0; s < kSegments; ++s) {
    const std::uint32_t next = (s + 1) % kSegments;
    mesh.triangles.push_back({bottom, next, s});
    for (std::uint32_t r = 0; r + 1 < rings; ++r) {
      const std::uint32_t a = r * kSegments + s, b = r * kSegments + next;
      mesh.triangles.push_back({a, b, b + kSegments});
      mesh.triangles.push_back({a, b + kSegments, a + kSegments});
    }
    mesh.triangles.push_back({top, (rings - 1) * kSegments + s, (rings - 1) * kSegments + next});
  }
  return mesh;
}

}  // namespace

TriangleMesh box_mesh(const Eigen::Vector3d& size_m) {
  TriangleMesh mesh;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d sign(corner & 1 ? 0.5 : -0.5, corner & 2 ? 0.5 : -0.5, corner & 4 ? 0.5 : -0.5);
    mesh.vertices.push_back(sign.cwiseProduct(size_m).cast<float>());
  }
  mesh.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return mesh;
}

TriangleMesh cylinder_mesh(double radius_m, double length_m) {
  const double half = 0.5 * length_m;
  return lathe({{radius_m, -half}, {radius_m, half}}, -half, half);
}

TriangleMesh sphere_mesh(double radius_m) {
  std::vector<Eigen::Vector2d> profile;
  for (std::uint32_t r = 1; r < kRings; ++r) {
    const double latitude = kPi * (static_cast<double>(r) / kRings - 0.5);
    profile.emplace_back(radius_m * std::cos(latitude), radius_m * std::sin(latitude));
  }
  return lathe(profile, -radius_m, radius_m);
}

}  // namespace bodyschema
