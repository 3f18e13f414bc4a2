#pragma once

#include <Eigen/Core>
#include <deque>
#include <optional>

#include "bodyschema/evidence/posture_memory.hpp"

namespace bodyschema {

/// What pictures say of how long before or after their stamp they were taken, s: one more parameter beside those of a
/// Quadratic, in the same form.
struct TimeEvidence {
  Eigen::VectorXd with_state;  ///< the column of A beside that parameter: over all parameters of the quadratic
  double A = 0.0, b = 0.0;
};

/// How far the stamps of pictures err from picture to picture against those of the encoders: no frame of an arm that
/// moves knows its joints nearer than by their motion in that time. Told from frames beside each other that agree with
/// what is known, by how they differ: the most likely variance of the last such pairs, with a prior that counts as some
/// of them. What pictures beside each other have in common is no noise: that all are late is an effect (`latency`).
class StampNoise {
 public:
  /// @param believed_sd_s  before any frame
  explicit StampNoise(double believed_sd_s) : believed_s2_(believed_sd_s * believed_sd_s), variance_s2_(believed_s2_) {}

  /// Learns from a frame that agrees with a memory.
  /// @param frame  over the memory's parameters; what is considered is not looked at
  void learn(double time_s, const Quadratic& frame, const TimeEvidence& time, const PostureMemory& memory);
  /// What is left of a frame's say, whenever it was taken.
  void take_out(const TimeEvidence& time, Quadratic& frame) const;
  [[nodiscard]] double sd_s() const;

 private:
  /// How far off a stamp was, as its frame alone tells it; of a pair, how far the two were apart.
  struct Off {
    double off_s, variance_s2;
  };
  void find_variance();
  [[nodiscard]] double log_posterior(double variance_s2) const;

  double believed_s2_, variance_s2_;
  std::deque<Off> pairs_;
  std::optional<Off> single_;  ///< has no partner yet
  double single_at_s_ = 0.0;
};

}  // namespace bodyschema
