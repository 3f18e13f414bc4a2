#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <span>

#include "bodyschema/silhouette/silhouette_scorer.hpp"

namespace bodyschema::reference {

/// The silhouette by brute force, sharing nothing with the engines: the ray through every pixel
/// centre is intersected with every triangle in double precision; a hit nearer than 0.01 m along
/// the camera's axis does not count, nor does, under back-face culling, one from behind.
inline BinaryMask silhouette(const SilhouetteModel& model, const PinholeIntrinsics& camera,
                             std::span<const Eigen::Isometry3f> X_CB) {
  constexpr double kNear_m = 0.01;
  BinaryMask mask(camera.width, camera.height);
  for (std::size_t part = 0; part < model.parts.size(); ++part) {
    const Eigen::Isometry3d X = X_CB[part].cast<double>();
    for (const auto& triangle : model.parts[part].triangles) {
      Eigen::Vector3d p[3];
      bool all_in_front = true;
      for (int k = 0; k < 3; ++k) {
        p[k] = X * model.parts[part].vertices[triangle[static_cast<std::size_t>(k)]].cast<double>();
        all_in_front = all_in_front && p[k].z() > kNear_m;
      }
      int u_low = 0, v_low = 0, u_high = camera.width - 1, v_high = camera.height - 1;
      if (all_in_front) {  // only to save time
        double low[2] = {1e30, 1e30}, high[2] = {-1e30, -1e30};
        for (const auto& q : p) {
          const Eigen::Vector2d pixel = camera.project(q);
          for (int axis = 0; axis < 2; ++axis) {
            low[axis] = std::min(low[axis], pixel[axis]);
            high[axis] = std::max(high[axis], pixel[axis]);
          }
        }
        u_low = static_cast<int>(std::clamp(low[0] - 1.0, 0.0, 1e6));
        v_low = static_cast<int>(std::clamp(low[1] - 1.0, 0.0, 1e6));
        u_high = static_cast<int>(std::clamp(high[0] + 1.0, -1.0, 1.0 * u_high));
        v_high = static_cast<int>(std::clamp(high[1] + 1.0, -1.0, 1.0 * v_high));
      }
      const Eigen::Vector3d normal = (p[1] - p[0]).cross(p[2] - p[0]);
      const double offset = normal.dot(p[0]);
      if (model.culling == FaceCulling::kBack && !(offset < 0.0)) continue;
      // The ray hits the triangle where it passes its three sides on the same hand.
      const Eigen::Vector3d side[3] = {p[0].cross(p[1]), p[1].cross(p[2]), p[2].cross(p[0])};
      for (int v = v_low; v <= v_high; ++v) {
        for (int u = u_low; u <= u_high; ++u) {
          const Eigen::Vector3d ray = camera.ray({u, v});
          const double a = side[0].dot(ray), b = side[1].dot(ray), c = side[2].dot(ray);
          if (!((a >= 0 && b >= 0 && c >= 0) || (a <= 0 && b <= 0 && c <= 0))) continue;
          const double depth = offset / normal.dot(ray);  // ray.z() is 1
          if (depth >= kNear_m) mask.set(u, v);
        }
      }
    }
  }
  return mask;
}

inline SilhouetteCounts compare(const BinaryMask& predicted, const ObservedSilhouette& observed) {
  SilhouetteCounts counts;
  for (int v = 0; v < predicted.height(); ++v) {
    for (int u = 0; u < predicted.width(); ++u) {
      if (!observed.valid.empty() && !observed.valid.at(u, v)) continue;
      counts.predicted += predicted.at(u, v) ? 1u : 0u;
      counts.observed += observed.mask.at(u, v) ? 1u : 0u;
      counts.intersection += predicted.at(u, v) && observed.mask.at(u, v) ? 1u : 0u;
    }
  }
  return counts;
}

}  // namespace bodyschema::reference
