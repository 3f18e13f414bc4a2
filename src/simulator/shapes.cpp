#include "shapes.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "bodyschema/geometry/pose.hpp"

namespace bodyschema::simulator::shapes {
namespace {

void quad(TriangleMesh& mesh, std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
  mesh.triangles.push_back({a, b, c});
  mesh.triangles.push_back({a, c, d});
}

}  // namespace

TriangleMesh box(const Eigen::Vector3f& size) {
  return slab(size, std::max(size.x(), size.y()));
}

TriangleMesh slab(const Eigen::Vector3f& size, float square) {
  TriangleMesh mesh;
  const auto count = [&](float length) { return std::max(1, static_cast<int>(std::ceil(length / square - 1e-4f))); };
  const int nx = count(size.x());
  const int ny = count(size.y());
  const auto columns = static_cast<std::uint32_t>(nx + 1);
  for (const float z : {-0.5f, 0.5f}) {
    for (int j = 0; j <= ny; ++j) {
      for (int i = 0; i <= nx; ++i) {
        mesh.vertices.emplace_back(size.x() * (static_cast<float>(i) / static_cast<float>(nx) - 0.5f),
                                   size.y() * (static_cast<float>(j) / static_cast<float>(ny) - 0.5f), size.z() * z);
      }
    }
  }
  const std::uint32_t top = columns * static_cast<std::uint32_t>(ny + 1);
  const auto at = [&](int i, int j) { return static_cast<std::uint32_t>(j) * columns + static_cast<std::uint32_t>(i); };
  for (int j = 0; j < ny; ++j) {
    for (int i = 0; i < nx; ++i) {
      quad(mesh, top + at(i, j), top + at(i + 1, j), top + at(i + 1, j + 1), top + at(i, j + 1));
      quad(mesh, at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j));
    }
  }
  for (int i = 0; i < nx; ++i) {
    quad(mesh, at(i, 0), at(i + 1, 0), top + at(i + 1, 0), top + at(i, 0));
    quad(mesh, at(i + 1, ny), at(i, ny), top + at(i, ny), top + at(i + 1, ny));
  }
  for (int j = 0; j < ny; ++j) {
    quad(mesh, at(0, j + 1), at(0, j), top + at(0, j), top + at(0, j + 1));
    quad(mesh, at(nx, j), at(nx, j + 1), top + at(nx, j + 1), top + at(nx, j));
  }
  return mesh;
}

TriangleMesh turned(const std::vector<Eigen::Vector2f>& profile, int segments) {
  TriangleMesh mesh;
  std::vector<std::uint32_t> ring;  // first vertex of each
  for (const auto& p : profile) {
    ring.push_back(static_cast<std::uint32_t>(mesh.vertices.size()));
    const int n = p.x() > 0.0f ? segments : 1;
    for (int s = 0; s < n; ++s) {
      const double angle = 2.0 * kPi * s / segments;
      mesh.vertices.emplace_back(p.x() * static_cast<float>(std::cos(angle)),
                                 p.x() * static_cast<float>(std::sin(angle)), p.y());
    }
  }
  for (std::size_t r = 0; r + 1 < profile.size(); ++r) {
    for (int s = 0; s < segments; ++s) {
      const auto at = [&](std::size_t which, int segment) {
        return ring[which] + (profile[which].x() > 0.0f ? static_cast<std::uint32_t>(segment % segments) : 0u);
      };
      const auto a = at(r, s), b = at(r, s + 1), c = at(r + 1, s + 1), d = at(r + 1, s);
      if (a != b) mesh.triangles.push_back({a, b, c});
      if (c != d) mesh.triangles.push_back({a, c, d});
    }
  }
  return mesh;
}

TriangleMesh rod(const Eigen::Vector3f& a, const Eigen::Vector3f& b, float radius_a, float radius_b, int segments) {
  const float length = (b - a).norm();
  std::vector<Eigen::Vector2f> profile;
  constexpr int kRound = 5;
  for (int i = 0; i <= kRound; ++i) {
    const auto angle = static_cast<float>(0.5 * kPi * i / kRound);
    profile.emplace_back(i == 0 ? 0.0f : radius_a * std::sin(angle), -radius_a * std::cos(angle));
  }
  for (int i = 0; i <= kRound; ++i) {
    const auto angle = static_cast<float>(0.5 * kPi * i / kRound);
    profile.emplace_back(i == kRound ? 0.0f : radius_b * std::cos(angle), length + radius_b * std::sin(angle));
  }
  Eigen::Isometry3f X = Eigen::Isometry3f::Identity();
  X.linear() = Eigen::Quaternionf::FromTwoVectors(Eigen::Vector3f::UnitZ(), b - a).toRotationMatrix();
  X.translation() = a;
  return moved(turned(profile, segments), X);
}

TriangleMesh ellipsoid(const Eigen::Vector3f& radii, int segments) {
  std::vector<Eigen::Vector2f> profile;
  const int rings = std::max(4, segments / 2);
  for (int i = 0; i <= rings; ++i) {
    const auto angle = static_cast<float>(kPi * i / rings);
    profile.emplace_back(i == 0 || i == rings ? 0.0f : std::sin(angle), -std::cos(angle));
  }
  auto mesh = turned(profile, segments);
  for (auto& p : mesh.vertices) p = p.cwiseProduct(radii);
  return mesh;
}

TriangleMesh moved(TriangleMesh mesh, const Eigen::Isometry3f& X) {
  for (auto& p : mesh.vertices) p = X * p;
  return mesh;
}

TriangleMesh mirrored(TriangleMesh mesh) {
  for (auto& p : mesh.vertices) p.x() = -p.x();
  for (auto& t : mesh.triangles) std::swap(t[1], t[2]);
  return mesh;
}

TriangleMesh dilated(const TriangleMesh& mesh, float distance) {
  // Each vertex moves by the x that brings the planes of its faces nearest to where they should be:
  // sum over faces of area * (normal . x - distance)^2 least, and x short where that leaves it free.
  std::vector<Eigen::Matrix3d> A(mesh.vertices.size(), Eigen::Matrix3d::Zero());
  std::vector<Eigen::Vector3d> b(mesh.vertices.size(), Eigen::Vector3d::Zero());
  for (const auto& t : mesh.triangles) {
    const Eigen::Vector3d normal =
        (mesh.vertices[t[1]] - mesh.vertices[t[0]]).cross(mesh.vertices[t[2]] - mesh.vertices[t[0]]).cast<double>();
    const double twice_area = normal.norm();
    if (!(twice_area > 0.0)) continue;
    const Eigen::Vector3d n = normal / twice_area;
    for (const auto v : t) {
      A[v] += twice_area * n * n.transpose();
      b[v] += twice_area * static_cast<double>(distance) * n;
    }
  }
  TriangleMesh result = mesh;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const double weight = A[v].trace();
    if (!(weight > 0.0)) continue;
    const Eigen::Vector3d x = (A[v] + 1e-4 * weight * Eigen::Matrix3d::Identity()).ldlt().solve(b[v]);
    const double most = 3.0 * std::abs(static_cast<double>(distance));  // at needles faces meet far away
    result.vertices[v] += (x * std::min(1.0, most / std::max(1e-12, x.norm()))).cast<float>();
  }
  return result;
}

TriangleMesh coarse(const TriangleMesh& mesh, float cell, std::vector<std::size_t>* source) {
  std::map<std::array<int, 3>, std::uint32_t> cells;
  TriangleMesh result;
  std::vector<std::uint32_t> new_vertex;
  std::vector<float> counts;
  for (const auto& p : mesh.vertices) {
    const auto at = [&](int axis) { return static_cast<int>(std::floor(p[axis] / cell)); };
    const auto [found, is_new] =
        cells.emplace(std::array<int, 3>{at(0), at(1), at(2)}, static_cast<std::uint32_t>(result.vertices.size()));
    if (is_new) {
      result.vertices.emplace_back(Eigen::Vector3f::Zero());
      counts.push_back(0.0f);
    }
    result.vertices[found->second] += p;
    counts[found->second] += 1.0f;
    new_vertex.push_back(found->second);
  }
  for (std::size_t v = 0; v < result.vertices.size(); ++v) result.vertices[v] /= counts[v];
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
    const auto& t = mesh.triangles[f];
    const std::array<std::uint32_t, 3> n = {new_vertex[t[0]], new_vertex[t[1]], new_vertex[t[2]]};
    if (n[0] == n[1] || n[1] == n[2] || n[2] == n[0]) continue;
    result.triangles.push_back(n);
    if (source != nullptr) source->push_back(f);
  }
  return result;
}

void add(PaintedPart& part, const TriangleMesh& mesh, const Paint& paint) {
  const auto first = static_cast<std::uint32_t>(part.mesh.vertices.size());
  part.mesh.vertices.insert(part.mesh.vertices.end(), mesh.vertices.begin(), mesh.vertices.end());
  for (const auto& t : mesh.triangles) {
    part.mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
    part.paint_of_triangle.push_back(static_cast<std::uint8_t>(part.paints.size()));
  }
  part.paints.push_back(paint);
}

}  // namespace bodyschema::simulator::shapes
