#pragma once

#include <array>
#include <span>

#include "bodyschema/outline/outline_measurement.hpp"

namespace bodyschema {

/// How outlines err in the pictures of one camera, measured on the residuals that a fit leaves: how far, and over what
/// length of outline alike. A mask that is ragged, a mesh that is a millimetre too thick, a shadow: errors of real
/// outlines are no noise of pixels, but alike over whole flanks. What a picture tells is the fewer numbers for it.
///
/// Residuals of the same side of a body count as alike by their mean product as a function of the distance between
/// them, pooled over all pictures seen; old ones fade. Begins with a prior worth a few pictures. Lengths are px of a
/// 320x240 picture (picture_unit).
class OutlineNoise {
 public:
  struct Prior {
    double sd_px = 0.4;  ///< of a residual
    /// Nearer than this no picture places the outline of a whole flank, however smooth it is: blur and thresholds shift
    /// it with light and shadow, in all pictures alike, which residuals do not show.
    double floor_px = 0.1;
    double correlated_points = 2.0;  ///< that err as one
    double pictures = 3.0;           ///< that it counts as
  };
  OutlineNoise() : OutlineNoise(Prior{}) {}
  explicit OutlineNoise(const Prior& prior) : prior_(prior) {}

  /// Adds one picture's matched points.
  /// @param memory_pictures  after so many a picture counts 1/e; 0: none fades
  void add(std::span<const OutlinePoint> points, double unit_px, double memory_pictures = 0.0);

  /// Of one residual: robust (from the median), so that a tool no mesh shows does not count.
  [[nodiscard]] double sd_px() const;
  /// How many neighbouring points err as one, at the spacing the points had.
  [[nodiscard]] double correlated_points() const;
  /// Distance at which residuals are half alike.
  [[nodiscard]] double correlation_px() const;
  /// What an evidence's A and b, made with the robust scale of `robust_px`, are to be divided by: the variance of a
  /// residual, times how many err as one, for the M-estimator of OutlineSearch (Huber 1981, eq. 6.5.12). Squares of
  /// units of a 320x240 picture.
  [[nodiscard]] double variance_px2() const;
  /// The robust scale for such residuals (OutlineSearch::robust_px).
  [[nodiscard]] double robust_px() const;

 private:
  static constexpr std::size_t kBins = 10;
  /// Upper ends of the bins of distance.
  static constexpr std::array<double, kBins> kBin_px = {3, 6, 9, 12, 18, 24, 36, 48, 64, 80};

  Prior prior_;
  double pictures_ = 0.0, points_ = 0.0;
  double median_square_ = 0.0;              ///< sum over pictures of the squared sd by the median
  double psi_square_ = 0.0, weight_ = 0.0;  ///< sums over points
  double slope_ = 0.0;                      ///< ... of the derivative of weight times residual
  std::array<double, kBins> product_{}, pairs_{};
};

/// Mean over the cameras of what their evidence is to be divided by.
double mean_variance_px2(std::span<const OutlineNoise> cameras);
/// The robust scale of the camera whose outlines are noisiest, for a search that all cameras share.
double widest_robust_px(std::span<const OutlineNoise> cameras);

}  // namespace bodyschema
