#include "bodyschema/search/simplified_mesh.hpp"

#ifndef BODYSCHEMA_HAVE_MESHOPTIMIZER

namespace bodyschema {

TriangleMesh simplified_mesh(const TriangleMesh& mesh, double) {
  return mesh;
}

}  // namespace bodyschema

#else

#include <meshoptimizer.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "bodyschema/core/digest.hpp"
#include "bodyschema/core/user_cache.hpp"
#include "bodyschema/geometry/pose.hpp"
#include "bodyschema/silhouette/silhouette_scorer.hpp"

namespace bodyschema {
namespace {

/// Below this, drawing costs less than there is to save.
constexpr std::size_t kFewTriangles = 500;

TriangleMesh without_unused_vertices(const TriangleMesh& mesh, std::span<const unsigned int> indices) {
  TriangleMesh out;
  out.name = mesh.name;
  std::vector<std::uint32_t> number(mesh.vertices.size(), ~0u);
  for (std::size_t i = 0; i + 2 < indices.size(); i += 3) {
    auto& t = out.triangles.emplace_back();
    for (std::size_t k = 0; k < 3; ++k) {
      auto& n = number[indices[i + k]];
      if (n == ~0u) {
        n = static_cast<std::uint32_t>(out.vertices.size());
        out.vertices.push_back(mesh.vertices[indices[i + k]]);
      }
      t[k] = n;
    }
  }
  return out;
}

/// A mesh seen from all sides, from so far that its size does not change.
class Views {
 public:
  explicit Views(const TriangleMesh& mesh)
      : full_(make_silhouette_scorer({{mesh}, FaceCulling::kNone}, kCamera, {"contour", "auto", 1})) {
    Eigen::AlignedBox3f box;
    for (const auto& v : mesh.vertices) box.extend(v);
    const float radius = 0.5f * box.diagonal().norm(), distance = kRadii * radius;
    metres_per_px_ = distance / static_cast<float>(kCamera[0].fx);
    for (int i = 0; i < kViews; ++i) {  // evenly over the sphere, along a spiral
      const float z = 1.0f - (2.0f * static_cast<float>(i) + 1.0f) / kViews;
      const float around = 2.39996323f * static_cast<float>(i), r = std::sqrt(1.0f - z * z);
      const Eigen::Vector3f direction(r * std::cos(around), r * std::sin(around), z);
      auto& X = poses_.emplace_back(Eigen::Quaternionf::FromTwoVectors(direction, Eigen::Vector3f::UnitZ()));
      X.translation() = Eigen::Vector3f(0, 0, distance) - X.linear() * box.center();
    }
  }

  /// How far the outline of another mesh lies from this one's: the area between the two over the outline's length, in
  /// the worst view. @returns metres
  double outline_distance_m(const TriangleMesh& other) {
    const auto drawn = make_silhouette_scorer({{other}, FaceCulling::kNone}, kCamera, {"contour", "auto", 1});
    double worst_px = 0.0;
    std::vector<ObservedSilhouette> seen(1);
    std::vector<SilhouetteCounts> counts(1);
    for (const auto& X : poses_) {
      seen[0].mask = drawn->render({&X, 1}, 0);
      full_->set_observation(seen);
      full_->score({&X, 1}, counts);
      const double between = static_cast<double>(counts[0].union_count() - counts[0].intersection);
      worst_px = std::max(worst_px, between / std::max(1.0, outline_px(seen[0].mask)));
    }
    return worst_px * metres_per_px_;
  }

 private:
  /// By Crofton: sides of pixels between robot and background, in all directions alike.
  static double outline_px(const BinaryMask& mask) {
    int sides = 0;
    for (int v = 1; v < mask.height(); ++v) {
      for (int u = 1; u < mask.width(); ++u) {
        sides += (mask.at(u, v) != mask.at(u - 1, v) ? 1 : 0) + (mask.at(u, v) != mask.at(u, v - 1) ? 1 : 0);
      }
    }
    return 0.25 * kPi * sides;
  }

  static constexpr int kViews = 24;
  static constexpr float kRadii = 20.0f;
  static constexpr std::array<PinholeIntrinsics, 1> kCamera{{{512, 512, kRadii * 250.0, kRadii * 250.0, 255.5, 255.5}}};
  std::unique_ptr<SilhouetteScorer> full_;
  std::vector<Eigen::Isometry3f> poses_;
  double metres_per_px_ = 0.0;
};

TriangleMesh simplify(const TriangleMesh& mesh, double bound_m) {
  std::vector<unsigned int> indices, simpler(3 * mesh.triangles.size());
  for (const auto& t : mesh.triangles) indices.insert(indices.end(), t.begin(), t.end());
  const float* positions = mesh.vertices[0].data();
  const float scale = meshopt_simplifyScale(positions, mesh.vertices.size(), sizeof(mesh.vertices[0]));
  if (!(scale > 0.0f)) return mesh;
  Views views(mesh);
  // Its error is of the surface, mostly away from any outline: how much of it an outline gets depends on the mesh.
  constexpr int kTries = 8;
  double target_m = 4.0 * bound_m;
  for (int attempt = 0; attempt < kTries; ++attempt, target_m *= 0.7) {
    const std::size_t count =
        meshopt_simplify(simpler.data(), indices.data(), indices.size(), positions, mesh.vertices.size(),
                         sizeof(mesh.vertices[0]), 0, static_cast<float>(target_m) / scale, 0, nullptr);
    TriangleMesh candidate = without_unused_vertices(mesh, std::span(simpler).first(count));
    if (!candidate.triangles.empty() && views.outline_distance_m(candidate) <= bound_m) return candidate;
  }
  return mesh;
}

/// Head of a cache file, in this machine's byte order; vertices and triangles follow.
struct Head {
  std::array<char, 8> magic{'b', 's', 'm', 'e', 's', 'h', '0', '1'};
  double bound_m = 0.0;
  std::uint64_t full_vertices = 0, full_triangles = 0, vertices = 0, triangles = 0;
};

template <class T>
std::string_view bytes_of(const std::vector<T>& items) {
  return {reinterpret_cast<const char*>(items.data()), items.size() * sizeof(T)};
}

std::optional<TriangleMesh> unpack(const std::string& bytes, const Head& expected) {
  Head head;
  if (bytes.size() < sizeof head) return std::nullopt;
  std::memcpy(&head, bytes.data(), sizeof head);
  TriangleMesh mesh;
  if (head.magic != expected.magic || head.bound_m != expected.bound_m ||
      head.full_vertices != expected.full_vertices || head.full_triangles != expected.full_triangles ||
      head.vertices > head.full_vertices || head.triangles > head.full_triangles ||
      bytes.size() !=
          sizeof head + head.vertices * sizeof(mesh.vertices[0]) + head.triangles * sizeof(mesh.triangles[0])) {
    return std::nullopt;
  }
  mesh.vertices.resize(head.vertices);
  mesh.triangles.resize(head.triangles);
  const char* from = bytes.data() + sizeof head;
  std::memcpy(static_cast<void*>(mesh.vertices.data()), from, head.vertices * sizeof(mesh.vertices[0]));
  from += head.vertices * sizeof(mesh.vertices[0]);
  std::memcpy(mesh.triangles.data(), from, head.triangles * sizeof(mesh.triangles[0]));
  for (const auto& v : mesh.vertices) {
    if (!v.allFinite()) return std::nullopt;
  }
  for (const auto& t : mesh.triangles) {
    if (*std::max_element(t.begin(), t.end()) >= head.vertices) return std::nullopt;
  }
  return mesh;
}

}  // namespace

TriangleMesh simplified_mesh(const TriangleMesh& mesh, double bound_m) {
  if (mesh.triangles.size() <= kFewTriangles || !(bound_m > 0.0)) return mesh;
  Head head;
  head.bound_m = bound_m;
  head.full_vertices = mesh.vertices.size();
  head.full_triangles = mesh.triangles.size();
  const std::string_view vertices = bytes_of(mesh.vertices), triangles = bytes_of(mesh.triangles);
  const auto name = "meshes/" + Digest().add(vertices).add(triangles).add(&bound_m, sizeof bound_m).text();
  if (const auto bytes = read_cache(name)) {
    if (auto kept = unpack(*bytes, head)) {
      kept->name = mesh.name;
      return *std::move(kept);
    }
  }
  TriangleMesh result = simplify(mesh, bound_m);
  head.vertices = result.vertices.size();
  head.triangles = result.triangles.size();
  std::string bytes(reinterpret_cast<const char*>(&head), sizeof head);
  write_cache(name, bytes.append(bytes_of(result.vertices)).append(bytes_of(result.triangles)));
  return result;
}

}  // namespace bodyschema

#endif
