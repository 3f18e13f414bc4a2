#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "bodyschema/estimator/contour_alignment.hpp"
#include "bodyschema/estimator/estimator_options.hpp"
#include "bodyschema/estimator/offset_fusion.hpp"
#include "hypothesis_scorer.hpp"

namespace bodyschema {

/// A state moved onto the observed outline, and what the outline says about it there.
struct OutlineFit {
  Eigen::VectorXd x;
  ContourEvidence evidence;
  double distance = 1.0;  ///< Hammoude; of those that were searched for
};

/// Moves states onto a frame's observed outline by Gauss-Newton, held by what earlier frames said or by
/// the prior alone. One thread.
class OutlineFitter {
 public:
  /// @param prior  a memory without any frame
  /// @param joints  entries of the state that are joint offsets; they come first
  OutlineFitter(ContourAlignment& alignment, HypothesisScorer& scorer, const OffsetFusion& prior, Eigen::Index joints,
                const EstimatorOptions& options)
      : alignment_(alignment), scorer_(scorer), prior_(prior), joints_(joints), options_(options) {}

  /// From where the memory puts the arm to where this frame and the memory together see it.
  OutlineFit follow(const Observation& observation, const OffsetFusion& memory);
  /// The best of several starts after refinement without memory. `scorer` must have the same frame.
  OutlineFit search(const Observation& observation, std::span<const Eigen::VectorXd> starts);
  /// What the frame could still win against the memory that a fit followed, chi-square.
  [[nodiscard]] double pull_of(const OutlineFit& fit) const;
  /// Whether enough of the outline was found, and near enough.
  [[nodiscard]] bool fits(const ContourEvidence& evidence) const;
  /// Of one residual, px^2.
  [[nodiscard]] double variance_px2() const { return options_.residual_sd_px * options_.residual_sd_px; }

 private:
  /// Looks less and less far.
  void refine(const Observation& observation, const OffsetFusion& memory, std::span<const double> search_px,
              OutlineFit& fit);

  ContourAlignment& alignment_;
  HypothesisScorer& scorer_;
  const OffsetFusion& prior_;
  Eigen::Index joints_;
  const EstimatorOptions& options_;
};

}  // namespace bodyschema
