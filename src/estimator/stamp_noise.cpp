#include "stamp_noise.hpp"

#include <Eigen/Cholesky>
#include <cmath>

#include "limits.hpp"

namespace bodyschema {

void StampNoise::learn(double time_s, const Quadratic& frame, const TimeEvidence& time, const PostureMemory& memory) {
  if (time.A <= 0.0) return;
  const Eigen::VectorXd& x = memory.estimate().x;
  const auto n = x.size();
  const auto A = frame.A.topLeftCorner(n, n);
  const Eigen::VectorXd a = time.with_state.head(n);
  // With all that is not known of the state integrated out, in this posture.
  const Eigen::VectorXd h = (A + memory.posture_precision()).ldlt().solve(a);
  const double information = time.A - a.dot(h);
  const double score = time.b - a.dot(x) - h.dot(frame.b.head(n) - A * x);
  if (!(information > 0.0)) return;
  const Off off{score / information, 1.0 / information};
  if (!single_ || std::abs(time_s - single_at_s_) > limits::kStampsBeside_s) {
    single_ = off;
    single_at_s_ = time_s;
    return;
  }
  pairs_.push_back({off.off_s - single_->off_s, off.variance_s2 + single_->variance_s2});
  if (pairs_.size() > limits::kRecentStamps) pairs_.pop_front();
  single_.reset();
  find_variance();
}

void StampNoise::find_variance() {
  // Of the standard deviation, about what is believed of it: some hundred pairs tell it no nearer than a step.
  constexpr double kRange = 3e2, kStep = 1.2;
  double most = log_posterior(believed_s2_);
  variance_s2_ = believed_s2_;
  for (double factor = 1.0 / kRange; factor < kRange; factor *= kStep) {
    const double variance_s2 = factor * factor * believed_s2_, own = log_posterior(variance_s2);
    if (own <= most) continue;
    most = own;
    variance_s2_ = variance_s2;
  }
}

/// Normal stamps, each seen with its frame's own variance; before any, an inverse chi-square distribution about what is
/// believed.
double StampNoise::log_posterior(double variance_s2) const {
  double sum = -0.5 * limits::kStampsBelieved * (std::log(variance_s2) + believed_s2_ / variance_s2);
  for (const auto& pair : pairs_) {
    const double total = 2.0 * variance_s2 + pair.variance_s2;
    sum -= 0.5 * (std::log(total) + pair.off_s * pair.off_s / total);
  }
  return sum;
}

void StampNoise::take_out(const TimeEvidence& time, Quadratic& frame) const {
  if (time.A <= 0.0) return;
  const double precision = time.A + 1.0 / variance_s2_;
  frame.A -= time.with_state * (time.with_state.transpose() / precision);
  frame.b -= time.with_state * (time.b / precision);
}

double StampNoise::sd_s() const {
  return std::sqrt(variance_s2_);
}

}  // namespace bodyschema
