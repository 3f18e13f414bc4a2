#pragma once

#include <Eigen/Core>

#include "bodyschema/estimator/contour_alignment.hpp"

namespace bodyschema {

/// An information filter for a constant state, with exponential forgetting.
///
/// Holds everything all frames said so far about the state as one quadratic: offsets stay while the arm
/// moves, so directions that one pose cannot see are seen by another.
/// cost(x) = x' information x - 2 x' vector, plus the prior (x / sd)^2, which does not fade. There is no process noise:
/// old frames fade exponentially instead, so that slow changes are followed.
class OffsetFusion {
 public:
  /// @param prior_sd  of each parameter
  /// @param encoder_sd  of each parameter's own error in every single frame (encoder noise and
  ///   rounding, for joints; 0 for what does not change from frame to frame)
  OffsetFusion(const Eigen::VectorXd& prior_sd, const Eigen::VectorXd& encoder_sd);

  void forget_all();
  /// Multiplies everything learned by `factor` in (0, 1]; the prior stays.
  void fade(double factor);
  /// Adds one frame's evidence, linearised at x0, divided by the variance of a residual. The
  /// frame's own encoder error is integrated out: however sharp a picture, it says no more about an
  /// offset than the encoder reading it is compared with.
  /// @param share  of the frame's say that is its own: 1 / number of frames that err alike
  void add(const ContourEvidence& evidence, const Eigen::VectorXd& x0, double variance_px2, double share);

  /// The state in one frame: the fused one plus that frame's encoder error, given the frame's
  /// evidence at x0. What the hand's pose follows from.
  struct FrameState {
    Eigen::VectorXd x;
    Eigen::MatrixXd covariance;
  };
  [[nodiscard]] FrameState frame_state(const ContourEvidence& evidence, const Eigen::VectorXd& x0,
                                       double variance_px2) const;
  /// The same for a frame without evidence.
  [[nodiscard]] FrameState frame_state() const;

  /// Solves for the best state given everything fused plus one more frame's evidence at x0.
  [[nodiscard]] Eigen::VectorXd solve_with(const ContourEvidence& evidence, const Eigen::VectorXd& x0,
                                           double variance_px2) const;
  [[nodiscard]] Eigen::VectorXd mean() const;
  [[nodiscard]] Eigen::MatrixXd covariance() const;
  [[nodiscard]] double frames() const { return frames_; }

 private:
  Eigen::MatrixXd prior_information_;
  Eigen::VectorXd encoder_variance_;
  Eigen::MatrixXd information_;
  Eigen::VectorXd vector_;
  double frames_ = 0.0;
};

}  // namespace bodyschema
