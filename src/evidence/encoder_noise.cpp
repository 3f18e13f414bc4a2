#include "bodyschema/evidence/encoder_noise.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "bodyschema/core/order_statistics.hpp"
#include "bodyschema/evidence/distributions.hpp"

namespace bodyschema {
namespace {

/// Fourth differences of slower readings hold motion: one of 1 rad in 1 s leaves less than 0.02 deg at 20 Hz.
constexpr double kSlowest_s = 0.05;
constexpr std::size_t kFewestReadings = 50;
constexpr double kOfFourth = 8.3666;  ///< sqrt(70): fourth differences of white noise over its standard deviation
/// Of the changes. Readings in steps never change by less than one, and often by just that: the smallest changes are
/// alike. Without steps they are as small as one cares to look.
constexpr double kSmallest = 0.01, kSmall = 0.05, kAlike = 1.5;
constexpr std::size_t kFewestChanges = 100;  ///< of which one in a hundred is one

double median_period(std::span<const JointSample> encoders) {
  std::vector<double> periods;
  for (std::size_t i = 1; i < encoders.size(); ++i)
    periods.push_back(seconds(encoders[i].utime - encoders[i - 1].utime));
  return quantile(std::move(periods), 0.5);
}

}  // namespace

Eigen::VectorXd encoder_noise(std::span<const JointSample> encoders, double share) {
  if (encoders.empty()) return {};
  Eigen::VectorXd noise = Eigen::VectorXd::Zero(encoders.front().q.size());
  if (encoders.size() < kFewestReadings || median_period(encoders) > kSlowest_s) return noise;
  const double within = normal_quantile(1.0 - share);  // standard deviations that hold this share
  for (Eigen::Index j = 0; j < noise.size(); ++j) {
    std::vector<double> fourth, changes;
    for (std::size_t i = 1; i < encoders.size(); ++i) {
      const double change = std::abs(encoders[i].q[j] - encoders[i - 1].q[j]);
      if (change > 0.0) changes.push_back(change);
      if (i < 4) continue;
      fourth.push_back(std::abs(encoders[i].q[j] - 4.0 * encoders[i - 1].q[j] + 6.0 * encoders[i - 2].q[j] -
                                4.0 * encoders[i - 3].q[j] + encoders[i - 4].q[j]));
    }
    // A reading is off by up to half a step, also while it does not change.
    const bool enough = changes.size() >= kFewestChanges;
    const double smallest = quantile(changes, kSmallest), small = quantile(std::move(changes), kSmall);
    const double step = enough && small < kAlike * smallest ? small : 0.0;
    noise[j] = std::max(step / std::sqrt(12.0), quantile(std::move(fourth), share) / within / kOfFourth);
  }
  return noise;
}

}  // namespace bodyschema
