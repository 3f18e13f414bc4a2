#include "mesh_repair.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <unordered_map>
#include <utility>
#include <vector>

#include "bodyschema/core/seeded_random.hpp"

namespace bodyschema {
namespace {

struct Cell {
  std::int64_t x, y, z;
  friend bool operator==(const Cell&, const Cell&) = default;
};
struct CellHash {
  std::size_t operator()(const Cell& c) const {
    const auto x = static_cast<std::uint64_t>(c.x), y = static_cast<std::uint64_t>(c.y);
    return static_cast<std::size_t>(mixed_bits(mixed_bits(mixed_bits(x) + y) + static_cast<std::uint64_t>(c.z)));
  }
};

/// One use of an edge by a triangle, `low` < `high`.
struct EdgeUse {
  std::uint32_t low, high, triangle;
  bool forward;  // the triangle runs from low to high
};

/// Two triangles across one edge.
struct Neighbour {
  std::uint32_t triangle;
  bool agrees;  // they run along the edge in opposite directions, as they should
};

Eigen::Vector3d vertex(const TriangleMesh& mesh, std::uint32_t t, int corner) {
  return mesh.vertices[mesh.triangles[t][static_cast<std::size_t>(corner)]].cast<double>();
}

/// Whether a ray crosses the triangle (Moeller and Trumbore).
bool crosses(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, const Eigen::Vector3d& a,
             const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  const Eigen::Vector3d ab = b - a, ac = c - a, p = direction.cross(ac);
  const double det = ab.dot(p);
  if (std::abs(det) < 1e-30) return false;
  const Eigen::Vector3d s = origin - a, q = s.cross(ab);
  const double u = s.dot(p) / det, v = direction.dot(q) / det;
  return u >= 0 && v >= 0 && u + v <= 1 && ac.dot(q) / det > 0;
}

}  // namespace

void weld(TriangleMesh& mesh, double tolerance_m) {
  const double cell_m = 2.0 * tolerance_m;
  const double tolerance2 = tolerance_m * tolerance_m;
  std::unordered_map<Cell, std::vector<std::uint32_t>, CellHash> grid;
  grid.reserve(mesh.vertices.size());
  std::vector<Eigen::Vector3f> kept;
  std::vector<std::uint32_t> where(mesh.vertices.size());
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    const Eigen::Vector3d p = mesh.vertices[i].cast<double>();
    const Eigen::Vector3d g = p / cell_m;
    const auto cell_of = [](double x) { return static_cast<std::int64_t>(std::floor(x)); };
    // With cells of twice the tolerance only the nearer neighbour on each axis can hold a match.
    const Cell home{cell_of(g.x()), cell_of(g.y()), cell_of(g.z())};
    const auto step = [](double x) { return x - std::floor(x) < 0.5 ? -1 : 1; };
    const int dx = step(g.x()), dy = step(g.y()), dz = step(g.z());
    std::uint32_t found = UINT32_MAX;
    for (int corner = 0; corner < 8 && found == UINT32_MAX; ++corner) {
      const auto at =
          grid.find({home.x + (corner & 1 ? dx : 0), home.y + (corner & 2 ? dy : 0), home.z + (corner & 4 ? dz : 0)});
      if (at == grid.end()) continue;
      for (const std::uint32_t candidate : at->second) {
        if ((kept[candidate].cast<double>() - p).squaredNorm() <= tolerance2) {
          found = candidate;
          break;
        }
      }
    }
    if (found == UINT32_MAX) {
      found = static_cast<std::uint32_t>(kept.size());
      kept.push_back(mesh.vertices[i]);
      grid[home].push_back(found);
    }
    where[i] = found;
  }

  std::vector<std::array<std::uint32_t, 3>> triangles;
  triangles.reserve(mesh.triangles.size());
  std::vector<std::uint32_t> renumber(kept.size(), UINT32_MAX);
  std::vector<Eigen::Vector3f> used;
  for (const auto& t : mesh.triangles) {
    std::array<std::uint32_t, 3> w{where[t[0]], where[t[1]], where[t[2]]};
    if (w[0] == w[1] || w[1] == w[2] || w[2] == w[0]) continue;
    for (auto& v : w) {
      if (renumber[v] == UINT32_MAX) {
        renumber[v] = static_cast<std::uint32_t>(used.size());
        used.push_back(kept[v]);
      }
      v = renumber[v];
    }
    triangles.push_back(w);
  }
  mesh.vertices = std::move(used);
  mesh.triangles = std::move(triangles);
}

MeshReport check_and_orient(TriangleMesh& mesh) {
  MeshReport report;
  const auto count = static_cast<std::uint32_t>(mesh.triangles.size());

  std::vector<EdgeUse> uses;
  uses.reserve(3 * static_cast<std::size_t>(count));
  for (std::uint32_t t = 0; t < count; ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = mesh.triangles[t][k], b = mesh.triangles[t][(k + 1) % 3];
      uses.push_back({std::min(a, b), std::max(a, b), t, a < b});
    }
  }
  std::sort(uses.begin(), uses.end(), [](const EdgeUse& a, const EdgeUse& b) {
    return std::tie(a.low, a.high, a.triangle) < std::tie(b.low, b.high, b.triangle);
  });

  // Neighbours through manifold edges (at most one per side of a triangle), and open edges.
  std::vector<std::array<Neighbour, 3>> neighbours(count);
  std::vector<std::uint8_t> degree(count, 0), on_boundary(count, 0);
  for (std::size_t i = 0; i < uses.size();) {
    std::size_t end = i + 1;
    while (end < uses.size() && uses[end].low == uses[i].low && uses[end].high == uses[i].high) {
      ++end;
    }
    if (end - i == 2) {
      const bool agrees = uses[i].forward != uses[i + 1].forward;
      for (const auto& [from, to] : {std::pair{i, i + 1}, std::pair{i + 1, i}}) {
        const std::uint32_t t = uses[from].triangle;
        neighbours[t][degree[t]++] = {uses[to].triangle, agrees};
      }
    } else if ((end - i) % 2 == 1) {
      ++report.boundary_edges;
      for (std::size_t k = i; k < end; ++k) on_boundary[uses[k].triangle] = 1;
    }
    i = end;
  }

  // Walk each component, turning triangles to agree with the first.
  constexpr std::uint32_t kNone = UINT32_MAX;
  std::vector<std::uint32_t> component(count, kNone);
  std::vector<std::uint8_t> turned(count, 0);
  std::vector<std::vector<std::uint32_t>> members;
  std::vector<std::uint8_t> open;
  for (std::uint32_t seed = 0; seed < count; ++seed) {
    if (component[seed] != kNone) continue;
    const auto id = static_cast<std::uint32_t>(members.size());
    std::vector<std::uint32_t> queue{seed};
    component[seed] = id;
    std::size_t turned_here = 0;
    bool twisted = false, is_open = false;
    for (std::size_t head = 0; head < queue.size(); ++head) {
      const std::uint32_t t = queue[head];
      is_open = is_open || on_boundary[t] != 0;
      turned_here += turned[t];
      for (std::size_t k = 0; k < degree[t]; ++k) {
        const auto [other, agrees] = neighbours[t][k];
        const std::uint8_t wanted = agrees ? turned[t] : static_cast<std::uint8_t>(1 - turned[t]);
        if (component[other] == kNone) {
          component[other] = id;
          turned[other] = wanted;
          queue.push_back(other);
        } else if (turned[other] != wanted) {
          twisted = true;
        }
      }
    }
    if (twisted) {
      ++report.twisted_components;
      for (const std::uint32_t t : queue) turned[t] = 0;
    } else {
      if (2 * turned_here > queue.size()) {
        for (const std::uint32_t t : queue) turned[t] = static_cast<std::uint8_t>(1 - turned[t]);
        turned_here = queue.size() - turned_here;
      }
      report.turned_triangles += turned_here;
    }
    report.open_components += is_open ? 1 : 0;
    open.push_back(is_open || twisted ? 1 : 0);
    members.push_back(std::move(queue));
  }
  report.components = members.size();
  for (std::uint32_t t = 0; t < count; ++t) {
    if (turned[t] != 0) std::swap(mesh.triangles[t][1], mesh.triangles[t][2]);
  }

  // Inside-out closed components. The volume is summed about a vertex of the component itself.
  std::vector<std::uint32_t> inside_out;
  for (std::uint32_t id = 0; id < members.size(); ++id) {
    if (open[id] != 0) continue;
    const Eigen::Vector3d about = vertex(mesh, members[id].front(), 0);
    double volume6 = 0.0;
    for (const std::uint32_t t : members[id]) {
      volume6 += (vertex(mesh, t, 0) - about).dot((vertex(mesh, t, 1) - about).cross(vertex(mesh, t, 2) - about));
    }
    if (volume6 < 0.0) inside_out.push_back(id);
  }
  for (const std::uint32_t id : inside_out) {
    const std::uint32_t first = members[id].front();
    const Eigen::Vector3d origin = (vertex(mesh, first, 0) + vertex(mesh, first, 1) + vertex(mesh, first, 2)) / 3.0;
    const Eigen::Vector3d direction(0.5257311, 0.8131234, 0.2497853);  // along no model axis
    bool enclosed = false;
    for (std::uint32_t t = 0; t < count; ++t) {
      if (component[t] == id || open[component[t]] != 0) continue;
      enclosed ^= crosses(origin, direction, vertex(mesh, t, 0), vertex(mesh, t, 1), vertex(mesh, t, 2));
    }
    if (enclosed) continue;
    ++report.turned_components;
    for (const std::uint32_t t : members[id]) {
      std::swap(mesh.triangles[t][1], mesh.triangles[t][2]);
    }
  }
  return report;
}

std::string MeshReport::text() const {
  std::string line;
  const auto add = [&](const std::string& part) { line += (line.empty() ? "" : "; ") + part; };
  const auto of_all = [&](std::size_t n) {
    return std::to_string(n) + " of " + std::to_string(components) + " components";
  };
  if (boundary_edges != 0) {
    add("not closed: " + std::to_string(boundary_edges) + " boundary edges in " + of_all(open_components) +
        ", its silhouette depends on face_culling");
  }
  if (turned_triangles != 0) {
    add("winding repaired: " + std::to_string(turned_triangles) + " triangles were wound against their neighbours");
  }
  if (turned_components != 0) {
    add("winding repaired: " + of_all(turned_components) + " were inside out");
  }
  if (twisted_components != 0) {
    add("winding inconsistent: " + of_all(twisted_components) + " have no outside");
  }
  return line;
}

}  // namespace bodyschema
