#include "bodyschema/search/search_level.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>

#include "bodyschema/search/simplified_mesh.hpp"

namespace bodyschema {
namespace {

int shorter_side(std::span<const PinholeIntrinsics> cameras) {
  int least = std::numeric_limits<int>::max();
  for (const auto& k : cameras) least = std::min({least, k.width, k.height});
  return least;
}

SilhouetteModel simplified(const SilhouetteModel& model, double bound_m) {
  // Of an open part, back-face culling shows what each triangle faces: that is not to be moved.
  if (model.culling != FaceCulling::kNone) return model;
  SilhouetteModel light;
  light.culling = model.culling;
  for (const auto& part : model.parts) light.parts.push_back(simplified_mesh(part, bound_m));
  return light;
}

}  // namespace

PinholeIntrinsics every_nth_pixel(const PinholeIntrinsics& camera, int step) {
  const auto count = [&](int size) { return (size - step / 2 + step - 1) / step; };
  const double first = step / 2;
  return {count(camera.width), count(camera.height),       camera.fx / step,
          camera.fy / step,    (camera.cx - first) / step, (camera.cy - first) / step};
}

BinaryMask every_nth_pixel(const BinaryMask& mask, int step) {
  if (mask.empty() || step == 1) return mask;
  const auto size = every_nth_pixel(PinholeIntrinsics{mask.width(), mask.height(), 1, 1, 0, 0}, step);
  BinaryMask out(size.width, size.height);
  for (int v = 0; v < size.height; ++v) {
    const std::uint64_t* from = mask.row(v * step + step / 2);
    std::uint64_t* to = out.row(v);
    for (int u = 0, full = step / 2; u < size.width; ++u, full += step) {
      to[u >> 6] |= ((from[full >> 6] >> (full & 63)) & 1u) << (u & 63);
    }
  }
  return out;
}

double search_mesh_bound_m(const SilhouetteModel& model, std::span<const PinholeIntrinsics> level_cameras) {
  constexpr double kBound_px = 0.1;
  double radius = 0.0;
  for (const auto& part : model.parts) {
    Eigen::AlignedBox3f box;
    for (const auto& vertex : part.vertices) box.extend(vertex);
    if (!box.isEmpty()) radius = std::max(radius, 0.5 * static_cast<double>(box.diagonal().norm()));
  }
  return kBound_px * 2.0 * radius / shorter_side(level_cameras);
}

SearchLevel search_level(const SilhouetteModel& model, std::span<const PinholeIntrinsics> cameras) {
  constexpr int kRows = 120;
  SearchLevel level;
  level.step = std::max(1, shorter_side(cameras) / kRows);
  for (const auto& camera : cameras) level.cameras.push_back(every_nth_pixel(camera, level.step));
  level.mesh_bound_m = search_mesh_bound_m(model, level.cameras);
  level.model = simplified(model, level.mesh_bound_m);
  return level;
}

SilhouetteModel outline_level(const SilhouetteModel& model, std::span<const PinholeIntrinsics> cameras) {
  constexpr double kRows = 240.0, kFiner = 0.25;
  const double rows = shorter_side(cameras);
  return simplified(model, kFiner * search_mesh_bound_m(model, cameras) * rows / std::min(rows, kRows));
}

}  // namespace bodyschema
