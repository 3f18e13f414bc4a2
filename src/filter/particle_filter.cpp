#include "bodyschema/filter/particle_filter.hpp"

#include <algorithm>

#include "bodyschema/filter/kernel_density.hpp"
#include "bodyschema/filter/resampling.hpp"

namespace bodyschema {

ParticleFilter::ParticleFilter(Eigen::Index dimension, const ParticleFilterOptions& options)
    : options_(options), random_(options.seed) {
  const auto n = static_cast<Eigen::Index>(options.particles);
  states_.resize(dimension, n);
  scratch_.resize(dimension, n);
  weights_.resize(n);
  kde_.resize(n);
  ancestors_.resize(options.particles);
  reset(Eigen::VectorXd::Zero(dimension));
}

void ParticleFilter::reset(const Eigen::VectorXd& mean_rad) {
  for (Eigen::Index i = 0; i < states_.cols(); ++i) {
    for (Eigen::Index k = 0; k < states_.rows(); ++k) {
      states_(k, i) = mean_rad(k) + options_.initial_sd_rad * normal_(random_);
    }
  }
  weights_.setConstant(1.0 / static_cast<double>(states_.cols()));
  spread_rad_ = options_.spread_rad;
  best_ = 0;
  best_is_current_ = true;
}

void ParticleFilter::set_state(Eigen::Index particle, const Eigen::VectorXd& state_rad) {
  states_.col(particle) = state_rad;
}

void ParticleFilter::update(const Eigen::VectorXd& likelihood) {
  weights_ = likelihood;
  best_is_current_ = false;
}

Eigen::Index ParticleFilter::estimate_index() {
  if (!best_is_current_) {
    kernel_density(states_, weights_, options_.kde_sd_deg, kde_);
    best_ = densest_particle(weights_, kde_, options_.kde_alpha);
    best_is_current_ = true;
  }
  return best_;
}

Eigen::VectorXd ParticleFilter::mean() const {
  return states_ * weights_ / std::max(weights_.sum(), 1e-300);
}

Eigen::MatrixXd ParticleFilter::covariance() const {
  const Eigen::MatrixXd centred = states_.colwise() - mean();
  return centred * weights_.asDiagonal() * centred.transpose() / std::max(weights_.sum(), 1e-300);
}

double ParticleFilter::effective_sample_size() const {
  return bodyschema::effective_sample_size({weights_.data(), static_cast<std::size_t>(weights_.size())});
}

void ParticleFilter::resample_and_spread() {
  const double u = std::uniform_real_distribution<double>(0.0, 1.0)(random_);
  systematic_resampling({weights_.data(), static_cast<std::size_t>(weights_.size())}, u, ancestors_);
  for (std::size_t i = 0; i < ancestors_.size(); ++i) {
    const auto ancestor = static_cast<Eigen::Index>(ancestors_[i]);
    for (Eigen::Index k = 0; k < states_.rows(); ++k) {
      scratch_(k, static_cast<Eigen::Index>(i)) = states_(k, ancestor) + spread_rad_ * normal_(random_);
    }
  }
  states_.swap(scratch_);
  spread_rad_ = std::max(spread_rad_ * options_.spread_decay, options_.spread_min_rad);
}

}  // namespace bodyschema
