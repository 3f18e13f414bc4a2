#pragma once

#include <map>
#include <span>
#include <utility>
#include <vector>

#include "bodyschema/evidence/posture_memory.hpp"
#include "bodyschema/outline/outline_measurement.hpp"

namespace bodyschema {

/// What outlines of the parts get wrong alike in all postures: a hand of another make, a cover that no mesh shows, a
/// thing in the hand. No number of postures averages it out, and no disagreement between postures shows it; but what a
/// fit could not take up of it stays as residuals that keep their sign, part by part.
///
/// The middle of a sandwich, as of clustered residuals (Liang and Zeger, 1986): over the parts, the square of what a
/// part moves a fit by, its mean residual over postures times the robust weight of its points, less what chance leaves
/// there by how the same residuals vary between postures. A fingertip that is far off does not stand for the palm, nor
/// what the fit set aside for what it followed; but the part that a fit follows leaves the errors to others: none errs
/// by less than half of the parts do (their median). What a fit took up is not seen: as of any variance that is
/// measured on what a fit leaves, degrees of freedom make up for it, those of as many parts as have a say of their own
/// less those of the parameters that were fitted. Lengths are px of a 320x240 picture.
class ShapeError {
 public:
  /// @param memory_postures  after so many a posture counts 1/e; 0: none fades
  explicit ShapeError(double memory_postures = 0.0);
  /// Adds one posture's picture.
  void add(std::span<const OutlinePoint> points, std::size_t camera, double unit_px);
  /// All pictures of a posture were added. Parameters as of `variance_px2`.
  void end_posture(double floor_px, double fitted);
  /// Variance beyond what pictures can place outlines to anyway, times how many points of a part err as one by it: what
  /// an evidence's A is to be divided by where nothing else errs. px^2.
  /// @param floor_px  how near pictures can place outlines
  /// @param fitted  parameters that all postures together told
  [[nodiscard]] double variance_px2(double floor_px, double fitted) const;
  /// The same, but no smaller than its mean over recent postures. Shapes stay as they are, but what few parts show of
  /// them comes and goes with every posture.
  [[nodiscard]] double lasting_variance_px2(double floor_px, double fitted) const;
  /// Whether enough postures were seen to tell.
  [[nodiscard]] bool known() const;
  void forget() { *this = ShapeError(memory_postures_); }

 private:
  struct Part {
    int seen = 0;                                                  ///< postures
    double postures = 0.0, weight = 0.0, sum = 0.0, square = 0.0;  ///< of mean residuals; fading
  };
  double memory_postures_, kept_;                              ///< kept: of what was there, when a posture comes
  std::map<std::pair<std::size_t, std::size_t>, Part> parts_;  ///< by camera and part
  double postures_ = 0.0, recent_px2_ = 0.0;                   ///< fading; the variance's mean over these
};

/// What outlines that are wrong alike in all postures do to a memory's estimate: as if one average posture alone were
/// known, for the others err with it. No more than what was believed before any, as wide as that was found to be. To be
/// added to what the memory knows.
/// @param variance_share  ShapeError's variance over that of the residuals which the memory was taught with
Eigen::MatrixXd shape_covariance(const PostureMemory& memory, double variance_share);

}  // namespace bodyschema
