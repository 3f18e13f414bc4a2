#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstdint>
#include <numeric>
#include <vector>

#include "bodyschema/geometry/triangle_mesh.hpp"

namespace bodyschema {

/// Who is whose neighbour in a triangle mesh.
///
/// Vertices at exactly the same position are one vertex here (an STL soup becomes a surface), and
/// triangles that collapse by that are dropped. Every half-edge of a triangle is matched with one
/// that runs the other way between the same vertices; what stays unmatched is an open edge: a true
/// border, or a place where the winding of neighbours disagrees. More than two triangles on an edge
/// are matched in pairs.
struct MeshTopology {
  struct Edge {
    std::uint32_t from, to;     ///< vertices; triangle `left` runs from -> to
    std::uint32_t left, right;  ///< triangles; `right` runs to -> from
  };
  struct OpenEdge {
    std::uint32_t from, to;  ///< vertices in the order of the triangle
    std::uint32_t triangle;
  };

  std::vector<Eigen::Vector3f> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<Edge> edges;
  std::vector<OpenEdge> open_edges;
  std::vector<std::uint32_t> component;  ///< per triangle: its connected surface
  std::vector<bool> component_closed;    ///< per component: no open edge

  [[nodiscard]] bool closed() const { return open_edges.empty(); }
};

namespace detail {

inline std::uint32_t find_root(std::vector<std::uint32_t>& parent, std::uint32_t i) {
  while (parent[i] != i) i = parent[i] = parent[parent[i]];
  return i;
}

}  // namespace detail

/// Triangles must index existing vertices.
inline MeshTopology build_topology(const TriangleMesh& mesh) {
  MeshTopology topology;

  // Weld: sort vertices by position, give equal ones the same number.
  const auto count = static_cast<std::uint32_t>(mesh.vertices.size());
  std::vector<std::uint32_t> order(count);
  std::iota(order.begin(), order.end(), 0u);
  const auto before = [&](std::uint32_t a, std::uint32_t b) {
    const auto& p = mesh.vertices[a];
    const auto& q = mesh.vertices[b];
    return std::lexicographical_compare(p.data(), p.data() + 3, q.data(), q.data() + 3);
  };
  std::sort(order.begin(), order.end(), before);
  std::vector<std::uint32_t> welded(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    if (i == 0 || mesh.vertices[order[i - 1]] != mesh.vertices[order[i]]) {
      topology.vertices.push_back(mesh.vertices[order[i]]);
    }
    welded[order[i]] = static_cast<std::uint32_t>(topology.vertices.size()) - 1;
  }
  for (const auto& triangle : mesh.triangles) {
    const std::array<std::uint32_t, 3> t{welded[triangle[0]], welded[triangle[1]], welded[triangle[2]]};
    if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) topology.triangles.push_back(t);
  }

  // Half-edges sorted by their unordered vertex pair lie side by side with their partners.
  struct HalfEdge {
    std::uint32_t low, high, triangle;
    bool ascending;
  };
  std::vector<HalfEdge> halves;
  halves.reserve(topology.triangles.size() * 3);
  for (std::uint32_t t = 0; t < topology.triangles.size(); ++t) {
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t from = topology.triangles[t][static_cast<std::size_t>(k)];
      const std::uint32_t to = topology.triangles[t][static_cast<std::size_t>((k + 1) % 3)];
      halves.push_back({std::min(from, to), std::max(from, to), t, from < to});
    }
  }
  std::sort(halves.begin(), halves.end(), [](const HalfEdge& a, const HalfEdge& b) {
    if (a.low != b.low) return a.low < b.low;
    if (a.high != b.high) return a.high < b.high;
    if (a.ascending != b.ascending) return a.ascending;
    return a.triangle < b.triangle;
  });
  std::vector<std::uint32_t> parent(topology.triangles.size());
  std::iota(parent.begin(), parent.end(), 0u);
  for (std::size_t begin = 0; begin < halves.size();) {
    std::size_t end = begin;
    std::size_t middle = begin;  // first descending half-edge of the group
    while (end < halves.size() && halves[end].low == halves[begin].low && halves[end].high == halves[begin].high) {
      if (halves[end].ascending) middle = end + 1;
      const auto a = detail::find_root(parent, halves[begin].triangle);
      const auto b = detail::find_root(parent, halves[end].triangle);
      parent[std::max(a, b)] = std::min(a, b);
      ++end;
    }
    std::size_t up = begin;
    std::size_t down = middle;
    for (; up < middle && down < end; ++up, ++down) {
      topology.edges.push_back({halves[up].low, halves[up].high, halves[up].triangle, halves[down].triangle});
    }
    for (; up < middle; ++up) {
      topology.open_edges.push_back({halves[up].low, halves[up].high, halves[up].triangle});
    }
    for (; down < end; ++down) {
      topology.open_edges.push_back({halves[down].high, halves[down].low, halves[down].triangle});
    }
    begin = end;
  }

  topology.component.resize(topology.triangles.size());
  for (std::uint32_t t = 0; t < topology.triangles.size(); ++t) {
    const auto root = detail::find_root(parent, t);
    if (root == t) {
      topology.component[t] = static_cast<std::uint32_t>(topology.component_closed.size());
      topology.component_closed.push_back(true);
    } else {
      topology.component[t] = topology.component[root];  // roots have the smallest number
    }
  }
  for (const auto& edge : topology.open_edges) {
    topology.component_closed[topology.component[edge.triangle]] = false;
  }
  return topology;
}

}  // namespace bodyschema
