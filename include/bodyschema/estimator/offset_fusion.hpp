#pragma once

#include <Eigen/Core>

#include "bodyschema/estimator/contour_alignment.hpp"

namespace bodyschema {

/// Everything all frames said so far about the state, as one quadratic: offsets stay while the arm
/// moves, so directions that one pose cannot see are seen by another.
///
/// cost(x) = x' information x - 2 x' vector, plus the prior (x / sd)^2. Old frames fade
/// exponentially so that slow changes are followed.
class OffsetFusion {
 public:
  explicit OffsetFusion(const Eigen::VectorXd& prior_sd);

  void forget_all();
  /// Multiplies everything learned by `factor` in (0, 1]; the prior stays.
  void fade(double factor);
  /// Adds one frame's evidence, linearised at x0, divided by the variance of a residual.
  void add(const ContourEvidence& evidence, const Eigen::VectorXd& x0, double variance_px2);

  /// Solves for the best state given everything fused plus one more frame's evidence at x0.
  [[nodiscard]] Eigen::VectorXd solve_with(const ContourEvidence& evidence,
                                           const Eigen::VectorXd& x0, double variance_px2) const;
  [[nodiscard]] Eigen::VectorXd mean() const;
  [[nodiscard]] Eigen::MatrixXd covariance() const;
  [[nodiscard]] double frames() const { return frames_; }

 private:
  Eigen::MatrixXd prior_information_;
  Eigen::MatrixXd information_;
  Eigen::VectorXd vector_;
  double frames_ = 0.0;
};

}  // namespace bodyschema
