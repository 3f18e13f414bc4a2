#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <vector>

#include "bodyschema/estimator/estimator_options.hpp"
#include "bodyschema/filter/particle_filter.hpp"
#include "frame_model.hpp"
#include "hypothesis_scorer.hpp"

namespace bodyschema {

/// Particles: hypotheses about the joints' offsets, told apart by their silhouettes. In mode paper the best of them is
/// the estimate; in mode best they are where searches for an outline begin. All else of a state is taken from whoever
/// asks. `scorer` must have the frame in question. One thread.
class ParticleSearch {
 public:
  ParticleSearch(FrameModel& model, HypothesisScorer& scorer, const EstimatorOptions& options);

  /// Draws and compares all particles; what they hold beyond the offsets is that of x.
  void score(const Frame& frame, const Eigen::VectorXd& x);
  /// Weighs them by how they were scored.
  /// @return their effective number
  double weigh();

  /// The estimate by the paper, of particles that have been weighed. They are resampled then.
  struct Best {
    Eigen::VectorXd offsets_rad;
    double likelihood = 0.0;
    bool narrowest = false;  ///< the spread has fallen to its smallest
  };
  Best take_best();
  /// Covariance of the particles' offsets as they were when the last best one was taken.
  [[nodiscard]] const Eigen::MatrixXd& covariance() const { return covariance_; }

  /// Next frame's particles: resampled survivors, and half of them around some offsets.
  /// @param sd_rad  how well these are known; nothing: the arm is being searched for
  void spread(const Eigen::VectorXd& offsets_rad, const std::optional<Eigen::VectorXd>& sd_rad);
  /// The worse half makes way for slips of each joint, both ways and of all sizes up to the largest, and is scored.
  void suspect_slips(const Frame& frame, const Eigen::VectorXd& x);
  /// Offset of a joint in the nearest particle that stands for its slip.
  [[nodiscard]] std::optional<double> slipped_offset_rad(Eigen::Index joint) const;

  /// The first `count` particles, nearest first, with all else as in `rest`.
  [[nodiscard]] std::vector<Eigen::VectorXd> nearest(const Eigen::VectorXd& rest, std::size_t count) const;
  /// Distances of the guesses that the search began with, which no wrong minimum has led astray.
  Eigen::VectorXd score_first_guesses(const Frame& frame);
  /// ... the first `count` of them, nearest first.
  [[nodiscard]] std::vector<Eigen::VectorXd> nearest_guesses(const Eigen::VectorXd& distances, std::size_t count) const;
  /// Likelihood of offsets, one hypothesis per column, in a frame; all else as before any picture.
  Eigen::VectorXd likelihood(const Frame& frame, const Eigen::MatrixXd& offsets_rad);

  /// Spread as at first, about nothing known; what is random goes on.
  void restart();
  /// Wall clock spent placing particles since the last call.
  double take_placing_ms();

 private:
  /// Distances of offsets, one hypothesis per column, no more of them than there are particles; valid until the scorer
  /// scores again.
  const Eigen::VectorXd& score_offsets(const Frame& frame, const Eigen::VectorXd& rest,
                                       const Eigen::Ref<const Eigen::MatrixXd>& offsets_rad);

  FrameModel& model_;
  HypothesisScorer& scorer_;
  const EstimatorOptions& options_;
  Eigen::Index joints_;
  ParticleFilter filter_;
  Eigen::MatrixXd first_guesses_;
  Eigen::MatrixXd covariance_;
  Eigen::VectorXd distance_;                    ///< Hammoude, of the particles
  std::vector<Eigen::Index> slip_of_particle_;  ///< which joint's slip a particle stands for; -1: none
  double placing_ms_ = 0.0;
};

}  // namespace bodyschema
