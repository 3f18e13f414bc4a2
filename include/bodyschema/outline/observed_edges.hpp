#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>

#include "bodyschema/geometry/binary_mask.hpp"
#include "bodyschema/geometry/pinhole.hpp"
#include "bodyschema/observation/observation.hpp"

namespace bodyschema {

/// Where a picture shows the robot's outline: sought along the normal of a predicted one. It only looks at its picture,
/// which must outlive it.
///
/// The outline is where coverage falls through one half going outwards, found to a fraction of a pixel. Nothing is
/// found outside the picture or where pixels do not count.
class ObservedEdges {
 public:
  /// @param coverage  0 to 255, row by row; empty: `mask` says, pixel by pixel
  /// @param valid  pixels that count; empty: all
  ObservedEdges(std::span<const std::uint8_t> coverage, const BinaryMask& mask, const BinaryMask& valid, int width,
                int height);
  ObservedEdges(const CameraObservation& seen, const PinholeIntrinsics& k)
      : ObservedEdges(seen.coverage, seen.mask, seen.valid, k.width, k.height) {}

  /// Distance along the unit normal, px, outwards positive, to the outline nearest to `pixel`.
  [[nodiscard]] std::optional<double> find(const Eigen::Vector2d& pixel, const Eigen::Vector2d& normal,
                                           double search_px) const;

 private:
  [[nodiscard]] double at(double u, double v) const;
  [[nodiscard]] double value(int u, int v) const;

  std::span<const std::uint8_t> coverage_;
  const BinaryMask& mask_;
  const BinaryMask& valid_;
  int width_, height_;
};

}  // namespace bodyschema
