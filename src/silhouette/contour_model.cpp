#include "contour_model.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <string>

#include "bodyschema/core/error.hpp"
#include "bodyschema/geometry/mesh_topology.hpp"

namespace bodyschema::contour {
namespace {

// Poses beyond this are taken for nonsense; it keeps every later product finite.
constexpr float kFarthest_m = 1e6f;
// Typical distance between hand and eye: it only weighs direction against position when edges are
// sorted into blocks, so results do not depend on it.
constexpr float kTypicalDistance_m = 0.3f;

// Edges of one run: 64 bytes each, so that a run stays in the second-level cache while a batch of
// pictures goes through it.
constexpr std::size_t kRunEdges = 2048;

struct Plane {
  Eigen::Vector3f n = Eigen::Vector3f::Zero();
  float d = 0.0f;
};

Plane plane_through(const Eigen::Vector3f& a, const Eigen::Vector3f& b, const Eigen::Vector3f& c) {
  const Eigen::Vector3d normal = (b - a).cast<double>().cross((c - a).cast<double>());
  const double length = normal.norm();
  if (!(length > 0.0)) return {};  // no area: it faces nobody
  const Eigen::Vector3d n = normal / length;
  return {n.cast<float>(), static_cast<float>(n.dot(a.cast<double>()))};
}

struct RunEdge {
  Plane left, right;
  Eigen::Vector3f from, to;
};

// Orders edges so that each eight in a row have similar planes: halves the set along the direction
// in which its planes differ most, again and again.
void cluster(std::span<RunEdge> edges) {
  if (edges.size() <= kLanes) return;
  const auto feature = [](const RunEdge& edge, int axis) {
    switch (axis) {
      case 0:
      case 1:
      case 2: return 0.5f * (edge.left.n[axis] + edge.right.n[axis]);
      case 3: return 0.5f * (edge.left.d + edge.right.d) / kTypicalDistance_m;
      default: return (edge.left.n - edge.right.n).norm();
    }
  };
  int widest = 0;
  float width = -1.0f;
  for (int axis = 0; axis < 5; ++axis) {
    float low = std::numeric_limits<float>::max();
    float high = std::numeric_limits<float>::lowest();
    for (const auto& edge : edges) {
      const float value = feature(edge, axis);
      low = std::min(low, value);
      high = std::max(high, value);
    }
    if (high - low > width) {
      width = high - low;
      widest = axis;
    }
  }
  const std::size_t blocks = (edges.size() + kLanes - 1) / kLanes;
  const std::size_t middle = blocks / 2 * kLanes;
  std::nth_element(edges.begin(), edges.begin() + static_cast<std::ptrdiff_t>(middle), edges.end(),
                   [&](const RunEdge& a, const RunEdge& b) { return feature(a, widest) < feature(b, widest); });
  cluster(edges.first(middle));
  cluster(edges.subspan(middle));
}

void append_run(Part& part, std::span<const RunEdge> edges, int weight, bool always) {
  EdgeRun run;
  run.weight = weight;
  run.always = always;
  run.edge_count = static_cast<std::int32_t>(edges.size());
  const std::size_t blocks = (edges.size() + kLanes - 1) / kLanes;
  const std::size_t groups = (blocks + kLanes - 1) / kLanes;
  run.block_count = static_cast<std::int32_t>(blocks);
  const std::size_t first_block = part.blocks.size();
  part.blocks.resize(first_block + blocks, EdgeBlock{});  // padding faces nobody: never a contour
  part.ends.resize((first_block + blocks) * kLanes, EdgeEnds{});
  const std::size_t first_group = part.bounds.size();
  part.bounds.resize(first_group + groups, BlockBounds{});
  for (std::size_t g = 0; g < groups; ++g) {  // padding blocks are never open
    std::fill_n(part.bounds[first_group + g].d, kLanes, 1.0f);
  }
  for (std::size_t b = 0; b < blocks; ++b) {
    EdgeBlock& block = part.blocks[first_block + b];
    const std::size_t count = std::min<std::size_t>(kLanes, edges.size() - b * kLanes);
    Eigen::Vector3d mean_n = Eigen::Vector3d::Zero();
    double mean_d = 0.0;
    for (std::size_t k = 0; k < count; ++k) {
      const RunEdge& edge = edges[b * kLanes + k];
      block.left_nx[k] = edge.left.n.x();
      block.left_ny[k] = edge.left.n.y();
      block.left_nz[k] = edge.left.n.z();
      block.left_d[k] = edge.left.d;
      block.right_nx[k] = edge.right.n.x();
      block.right_ny[k] = edge.right.n.y();
      block.right_nz[k] = edge.right.n.z();
      block.right_d[k] = edge.right.d;
      EdgeEnds& ends = part.ends[(first_block + b) * kLanes + k];
      std::copy_n(edge.from.data(), 3, ends.from);
      std::copy_n(edge.to.data(), 3, ends.to);
      for (const Plane* plane : {&edge.left, &edge.right}) {
        mean_n += plane->n.cast<double>() / static_cast<double>(2 * count);
        mean_d += static_cast<double>(plane->d) / static_cast<double>(2 * count);
      }
    }
    double spread = 0.0;
    double slack = 0.0;
    for (std::size_t k = 0; k < count; ++k) {
      for (const Plane* plane : {&edges[b * kLanes + k].left, &edges[b * kLanes + k].right}) {
        spread = std::max(spread, (plane->n.cast<double>() - mean_n).norm());
        slack = std::max(slack, std::abs(static_cast<double>(plane->d) - mean_d));
      }
    }
    BlockBounds& bounds = part.bounds[first_group + b / kLanes];
    const std::size_t lane = b % kLanes;
    bounds.nx[lane] = static_cast<float>(mean_n.x());
    bounds.ny[lane] = static_cast<float>(mean_n.y());
    bounds.nz[lane] = static_cast<float>(mean_n.z());
    bounds.d[lane] = static_cast<float>(mean_d);
    // A little more than needed, for the rounding of the tests at run time.
    bounds.spread[lane] = static_cast<float>(spread) + 1e-6f;
    bounds.slack[lane] = static_cast<float>(slack) + 1e-6f * part.radius;
  }
  part.runs.push_back(run);
}

void append_runs(Part& part, std::vector<RunEdge> edges, int weight, bool always) {
  cluster(edges);
  for (std::size_t first = 0; first < edges.size(); first += kRunEdges) {
    append_run(part, std::span(edges).subspan(first, std::min(kRunEdges, edges.size() - first)), weight, always);
  }
}

Part prepare(const TriangleMesh& mesh, FaceCulling culling) {
  const MeshTopology topology = build_topology(mesh);
  Part part;
  Eigen::Vector3f low = topology.vertices.front();
  Eigen::Vector3f high = low;
  for (const auto& p : topology.vertices) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  part.centre = 0.5f * (low + high);
  part.half_extent = Eigen::Vector3f::Zero();
  part.vertices.reserve(topology.vertices.size());
  for (const auto& p : topology.vertices) {
    part.vertices.push_back(p - part.centre);
    part.radius = std::max(part.radius, part.vertices.back().norm());
    part.half_extent = part.half_extent.cwiseMax(part.vertices.back().cwiseAbs());
  }
  part.radius *= 1.0f + 1e-5f;
  part.triangles = topology.triangles;
  for (const auto component : topology.component) {
    part.closed.push_back(topology.component_closed[component]);
  }

  std::vector<Plane> planes;
  planes.reserve(part.triangles.size());
  for (const auto& t : part.triangles) {
    planes.push_back(plane_through(part.vertices[t[0]], part.vertices[t[1]], part.vertices[t[2]]));
  }

  // The winding number at a pixel is the sum over triangles that cover it of a weight. Triangles
  // that face away weigh nothing in a closed surface (each pixel they cover has a front as well) and
  // under back-face culling; otherwise they are turned over, weigh as much as fronts, and every
  // contour edge counts twice. An open edge under culling has a neighbour that never faces anyone.
  std::vector<RunEdge> single, twice, open;
  const bool cull = culling == FaceCulling::kBack;
  for (const auto& edge : topology.edges) {
    const bool closed = topology.component_closed[topology.component[edge.left]];
    (closed || cull ? single : twice)
        .push_back({planes[edge.left], planes[edge.right], part.vertices[edge.from], part.vertices[edge.to]});
  }
  for (const auto& edge : topology.open_edges) {
    (cull ? single : open)
        .push_back({planes[edge.triangle], Plane{Eigen::Vector3f::Zero(), 1.0f}, part.vertices[edge.from],
                    part.vertices[edge.to]});
  }
  append_runs(part, std::move(single), 1, false);
  append_runs(part, std::move(twice), 2, false);
  append_runs(part, std::move(open), 1, true);
  // Now that the vectors have stopped moving.
  std::size_t block = 0;
  std::size_t group = 0;
  for (auto& run : part.runs) {
    run.blocks = part.blocks.data() + block;
    run.ends = part.ends.data() + block * kLanes;
    run.bounds = part.bounds.data() + group;
    block += static_cast<std::size_t>(run.block_count);
    group += static_cast<std::size_t>((run.block_count + kLanes - 1) / kLanes);
  }
  return part;
}

}  // namespace

void check(const SilhouetteModel& model, std::span<const PinholeIntrinsics> cameras) {
  if (model.parts.empty()) throw std::invalid_argument("silhouette model has no parts");
  for (std::size_t p = 0; p < model.parts.size(); ++p) {
    const auto& mesh = model.parts[p];
    const std::string who = "silhouette part " + std::to_string(p) + " '" + mesh.name + "'";
    if (mesh.vertices.empty() || mesh.triangles.empty()) {
      throw FileError(who + " has no triangles");
    }
    for (const auto& v : mesh.vertices) {
      if (!v.allFinite() || v.cwiseAbs().maxCoeff() > kFarthest_m) {
        throw FileError(who + " has a vertex that is not finite or beyond 1000 km");
      }
    }
    for (const auto& t : mesh.triangles) {
      if (std::max({t[0], t[1], t[2]}) >= mesh.vertices.size()) {
        throw FileError(who + " has a triangle with vertex " + std::to_string(std::max({t[0], t[1], t[2]})) + " of " +
                        std::to_string(mesh.vertices.size()));
      }
    }
  }
  if (cameras.empty() || cameras.size() > 32) {
    throw std::invalid_argument("silhouettes need 1 to 32 cameras, got " + std::to_string(cameras.size()));
  }
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    const auto& k = cameras[c];
    const std::string who = "camera " + std::to_string(c);
    if (k.width < 1 || k.height < 1 || k.width > 8192 || k.height > 8192) {
      throw std::invalid_argument(who + " has size " + std::to_string(k.width) + "x" + std::to_string(k.height) +
                                  ", expected 1 to 8192 px a side");
    }
    if (!(k.fx > 0.0) || !(k.fy > 0.0) || !std::isfinite(k.fx) || !std::isfinite(k.fy) || !std::isfinite(k.cx) ||
        !std::isfinite(k.cy)) {
      throw std::invalid_argument(who + " needs positive fx and fy and finite cx and cy");
    }
  }
}

Model::Model(const SilhouetteModel& model) : culling_(model.culling) {
  parts_.reserve(model.parts.size());
  for (const auto& mesh : model.parts) {
    parts_.push_back(prepare(mesh, model.culling));
    max_edges_ = std::max(max_edges_, parts_.back().ends.size());
    max_vertices_ = std::max(max_vertices_, parts_.back().vertices.size());
  }
}

Camera::Camera(const PinholeIntrinsics& k) : intrinsics(k) {
  // u > -1, u < width, v > -1, v < height: a pixel of margin on each side.
  const auto unit = [](double x, double y, double z) {
    return Eigen::Vector3d(x, y, z).normalized().cast<float>().eval();
  };
  sides = {unit(k.fx, 0.0, k.cx + 1.0), unit(-k.fx, 0.0, k.width - k.cx), unit(0.0, k.fy, k.cy + 1.0),
           unit(0.0, -k.fy, k.height - k.cy)};
}

PlacedPart place(const Part& part, const Camera& camera, const Eigen::Isometry3f& X_CB) {
  PlacedPart placed;
  const Eigen::Matrix3f A = X_CB.linear();
  const Eigen::Vector3f p = A * part.centre + X_CB.translation();
  placed.R_CB = A;
  placed.p_CB = p;
  // How much A may stretch a length: 1 for a rotation, a little more for the small changes of scale
  // and shear that camera parameters bring (Gershgorin's bound on the eigenvalues of A'A).
  const float stretch = std::sqrt((A.transpose() * A).cwiseAbs().rowwise().sum().maxCoeff());
  const float radius = stretch * part.radius;
  Eigen::Map<Eigen::Vector3f> camera_B(placed.camera_B);
  camera_B = -(A.inverse() * p);
  // Written so that a NaN anywhere leaves the part out.
  const bool sane =
      p.cwiseAbs().maxCoeff() < kFarthest_m && radius < kFarthest_m && camera_B.cwiseAbs().maxCoeff() < kFarthest_m;
  if (!sane || !(p.z() + radius > kNearPlane_m)) return placed;
  for (const auto& side : camera.sides) {
    if (side.dot(p) < -radius) return placed;
  }
  placed.view = p.z() - radius > kNearPlane_m ? View::kInFront : View::kCut;
  const auto& k = camera.intrinsics;
  const auto fx = static_cast<float>(k.fx), fy = static_cast<float>(k.fy);
  const auto cx = static_cast<float>(k.cx), cy = static_cast<float>(k.cy);
  for (int column = 0; column < 4; ++column) {
    const Eigen::Vector3f q = column < 3 ? Eigen::Vector3f(placed.R_CB.col(column)) : p;
    placed.P[column] = fx * q.x() + cx * q.z();
    placed.P[4 + column] = fy * q.y() + cy * q.z();
    placed.P[8 + column] = q.z();
  }
  return placed;
}

}  // namespace bodyschema::contour
