#include "bodyschema/estimator/offset_fusion.hpp"

#include <Eigen/Cholesky>

namespace bodyschema {

OffsetFusion::OffsetFusion(const Eigen::VectorXd& prior_sd, const Eigen::VectorXd& encoder_sd)
    : encoder_variance_(encoder_sd.array().square()) {
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

void OffsetFusion::add(const ContourEvidence& evidence, const Eigen::VectorXd& x0, double variance_px2, double share) {
  // The picture sees x + e with e ~ N(0, R): marginalised, A becomes A (I + R A)^-1.
  const Eigen::Index n = x0.size();
  const Eigen::MatrixXd A = evidence.A / variance_px2;
  const Eigen::MatrixXd damping = (Eigen::MatrixXd::Identity(n, n) + A * encoder_variance_.asDiagonal()).inverse();
  const Eigen::MatrixXd A_marginal = damping * A;
  information_ += 0.5 * share * (A_marginal + A_marginal.transpose());
  vector_ += share * (A_marginal * x0 + damping * evidence.b / variance_px2);
  frames_ += 1.0;
}

OffsetFusion::FrameState OffsetFusion::frame_state(const ContourEvidence& evidence, const Eigen::VectorXd& x0,
                                                   double variance_px2) const {
  const FrameState before = frame_state();
  const Eigen::Index n = x0.size();
  const Eigen::MatrixXd prior = before.covariance.inverse();
  FrameState after;
  after.covariance = (prior + evidence.A / variance_px2).ldlt().solve(Eigen::MatrixXd::Identity(n, n));
  after.x = x0 + after.covariance * (evidence.b / variance_px2 + prior * (before.x - x0));
  return after;
}

OffsetFusion::FrameState OffsetFusion::frame_state() const {
  FrameState state;
  state.x = mean();
  state.covariance = covariance();
  state.covariance.diagonal() += encoder_variance_;
  return state;
}

Eigen::VectorXd OffsetFusion::solve_with(const ContourEvidence& evidence, const Eigen::VectorXd& x0,
                                         double variance_px2) const {
  const Eigen::MatrixXd information = prior_information_ + information_ + evidence.A / variance_px2;
  return information.ldlt().solve(vector_ + (evidence.A * x0 + evidence.b) / variance_px2);
}

Eigen::VectorXd OffsetFusion::mean() const {
  return (prior_information_ + information_).ldlt().solve(vector_);
}

Eigen::MatrixXd OffsetFusion::covariance() const {
  return (prior_information_ + information_).ldlt().solve(Eigen::MatrixXd::Identity(vector_.size(), vector_.size()));
}

}  // namespace bodyschema
