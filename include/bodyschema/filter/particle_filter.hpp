#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <random>
#include <vector>

namespace bodyschema {

/// Parameters of the paper's filter (section VI), here in radians unless the name says otherwise.
struct ParticleFilterOptions {
  std::size_t particles = 200;
  double initial_sd_rad = 0.08726646259971647;    ///< 5 deg
  double spread_rad = 0.05235987755982989;        ///< sigma_s at the first resampling, 3 deg
  double spread_decay = 0.8;                      ///< factor per frame
  double spread_min_rad = 0.0017453292519943296;  ///< 0.10 deg
  double kde_sd_deg = 1.0;
  double kde_alpha = 500.0;
  std::uint64_t seed = 1;
};

/// The paper's particle filter over joint offsets: state x = offsets, x(t+1) = x(t) + w
/// (equation 2). It knows neither pictures nor messages: somebody scores `states()` and hands the
/// likelihoods back.
///
/// One frame: score states() -> update(likelihood) -> estimate() -> resample_and_spread().
/// Same seed and likelihoods, same result, bit for bit. One thread.
class ParticleFilter {
 public:
  ParticleFilter(Eigen::Index dimension, const ParticleFilterOptions& options);

  /// Draws the initial cloud N(mean, initial_sd^2 I) and restarts the spread.
  void reset(const Eigen::VectorXd& mean_rad);

  /// Particles, one per column, radians.
  [[nodiscard]] const Eigen::MatrixXd& states() const { return states_; }
  /// Replaces a particle, for estimators that inject hypotheses of their own.
  void set_state(Eigen::Index particle, const Eigen::VectorXd& state_rad);

  /// Sets the weights; not negative, at least one positive.
  void update(const Eigen::VectorXd& likelihood);

  /// Index of the particle with the largest W (equation 5). The density compares every pair of
  /// particles, so it is worked out when first asked for after an update.
  [[nodiscard]] Eigen::Index estimate_index();
  [[nodiscard]] Eigen::VectorXd estimate() { return states_.col(estimate_index()); }
  /// Weighted mean and covariance of the cloud, radians and square radians.
  [[nodiscard]] Eigen::VectorXd mean() const;
  [[nodiscard]] Eigen::MatrixXd covariance() const;
  [[nodiscard]] double effective_sample_size() const;

  /// Systematic resampling, then N(0, sigma_s^2 I) is added and sigma_s decays.
  void resample_and_spread();
  [[nodiscard]] double spread_rad() const { return spread_rad_; }
  void set_spread(double spread_rad) { spread_rad_ = spread_rad; }

  [[nodiscard]] std::mt19937_64& random() { return random_; }

 private:
  ParticleFilterOptions options_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_{0.0, 1.0};
  Eigen::MatrixXd states_;
  Eigen::MatrixXd scratch_;
  Eigen::VectorXd weights_;
  Eigen::VectorXd kde_;
  std::vector<std::size_t> ancestors_;
  Eigen::Index best_ = 0;
  bool best_is_current_ = true;
  double spread_rad_ = 0.0;
};

}  // namespace bodyschema
