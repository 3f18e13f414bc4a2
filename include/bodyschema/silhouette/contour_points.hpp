#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "bodyschema/geometry/pinhole.hpp"
#include "bodyschema/silhouette/silhouette_scorer.hpp"

namespace bodyschema {

/// One sample of the outline of a predicted silhouette.
struct ContourPoint {
  Eigen::Vector2f pixel;   ///< on the outline, px, OpenCV convention, sub-pixel
  Eigen::Vector2f normal;  ///< unit, in the image, pointing out of the silhouette
  Eigen::Vector3f p_C;     ///< the surface point that makes the outline, camera frame, metres
  std::uint32_t part = 0;  ///< the part it belongs to
};

/// Samples the outline of the union of all parts: points of occluding edges (between a triangle
/// that faces the camera and one that does not, or on a boundary) that border the background and
/// are not covered by another part, about one per `spacing_px` of outline. Points closer than
/// `margin_px` to the picture's border are left out: the border is not an outline.
///
/// One extractor per thread; allocates nothing once warm.
class ContourExtractor {
 public:
  ContourExtractor(const SilhouetteModel& model, std::span<const PinholeIntrinsics> cameras);
  /// For another thread: shares the meshes.
  ContourExtractor(const ContourExtractor& other);
  ContourExtractor& operator=(const ContourExtractor&) = delete;
  ~ContourExtractor();
  ContourExtractor(ContourExtractor&&) noexcept;

  /// @param X_CB  pose of each part in the camera, metres
  /// The result is valid until the next call.
  std::span<const ContourPoint> extract(std::span<const Eigen::Isometry3f> X_CB, std::size_t camera,
                                        float spacing_px = 3.0f, float margin_px = 3.0f);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace bodyschema
