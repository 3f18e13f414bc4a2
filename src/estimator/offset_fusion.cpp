#include "bodyschema/estimator/offset_fusion.hpp"

#include <Eigen/Cholesky>

namespace bodyschema {

OffsetFusion::OffsetFusion(const Eigen::VectorXd& prior_sd) {
  prior_information_ = prior_sd.array().square().inverse().matrix().asDiagonal();
  information_.setZero(prior_sd.size(), prior_sd.size());
  vector_.setZero(prior_sd.size());
}

void OffsetFusion::forget_all() {
  information_.setZero();
  vector_.setZero();
  frames_ = 0.0;
}

void OffsetFusion::fade(double factor) {
  information_ *= factor;
  vector_ *= factor;
  frames_ *= factor;
}

void OffsetFusion::add(const ContourEvidence& evidence, const Eigen::VectorXd& x0,
                       double variance_px2) {
  information_ += evidence.A / variance_px2;
  vector_ += (evidence.A * x0 + evidence.b) / variance_px2;
  frames_ += 1.0;
}

Eigen::VectorXd OffsetFusion::solve_with(const ContourEvidence& evidence,
                                         const Eigen::VectorXd& x0, double variance_px2) const {
  const Eigen::MatrixXd information =
      prior_information_ + information_ + evidence.A / variance_px2;
  return information.ldlt().solve(vector_ + (evidence.A * x0 + evidence.b) / variance_px2);
}

Eigen::VectorXd OffsetFusion::mean() const {
  return (prior_information_ + information_).ldlt().solve(vector_);
}

Eigen::MatrixXd OffsetFusion::covariance() const {
  return (prior_information_ + information_)
      .ldlt()
      .solve(Eigen::MatrixXd::Identity(vector_.size(), vector_.size()));
}

}  // namespace bodyschema
