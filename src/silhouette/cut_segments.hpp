#pragma once

// Included by contour_model.hpp.

#include "near_plane.hpp"

namespace bodyschema::contour {

template <typename Sink>
void for_each_cut_segment(const Part& part, FaceCulling culling, const PlacedPart& placed,
                          std::span<Eigen::Vector3f> scratch, Sink&& sink) {
  for (std::size_t i = 0; i < part.vertices.size(); ++i) {
    scratch[i] = placed.R_CB * part.vertices[i] + placed.p_CB;
  }
  for (const auto& triangle : part.triangles) {
    const Eigen::Vector3f* corner[3] = {&scratch[triangle[0]], &scratch[triangle[1]], &scratch[triangle[2]]};
    // The camera is the origin: it sees the front when it lies on the normal's side.
    const Eigen::Vector3f normal = (*corner[1] - *corner[0]).cross(*corner[2] - *corner[0]);
    const bool front = normal.dot(*corner[0]) < 0.0f;
    if (!front && culling == FaceCulling::kBack) continue;
    const int weight = front ? 1 : -1;
    // Clip to the near plane: at most four corners remain.
    std::array<Eigen::Vector3f, 4> polygon;
    std::array<bool, 4> made_here{};  // whether the side that starts at this corner is a cut
    std::size_t corners = 0;
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3f& p = *corner[k];
      const Eigen::Vector3f& q = *corner[(k + 1) % 3];
      const bool p_in = p.z() >= kNearPlane_m;
      const bool q_in = q.z() >= kNearPlane_m;
      if (p_in) polygon[corners++] = p;
      if (p_in != q_in) {
        const float t = (kNearPlane_m - p.z()) / (q.z() - p.z());
        made_here[corners] = p_in;
        polygon[corners] = p + t * (q - p);
        polygon[corners++].z() = kNearPlane_m;
      }
    }
    for (std::size_t k = 0; corners >= 3 && k < corners; ++k) {
      sink(Segment{polygon[k], polygon[(k + 1) % corners], weight, !made_here[k]});
    }
  }
}

}  // namespace bodyschema::contour
