#include "interval.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

namespace bodyschema::diagnosis {
namespace {

/// Median over the parameters of how much wider a fit's errors are than white noise would make them.
double inflation(const BlockFit& fit) {
  if (!fit.usable || fit.estimate.size() == 0) return 1.0;
  std::vector<double> dispersion;
  for (Eigen::Index i = 0; i < fit.estimate.size(); ++i) {
    dispersion.push_back(fit.covariance(i, i) / fit.model_variance[i]);
  }
  const auto middle = dispersion.begin() + static_cast<std::ptrdiff_t>(dispersion.size() / 2);
  std::nth_element(dispersion.begin(), middle, dispersion.end());
  return *middle;
}

}  // namespace

double student95(double dof) {
  const double n = std::max(1.0, dof);
  return 1.96 + 2.37 / n + 2.8 / (n * n) + (n < 3.0 ? 5.0 / (n * n * n) : 0.0);
}

IntervalRule::IntervalRule(const BlockFit& final_fit, std::size_t blocks, double systematic_share,
                           std::map<std::string, double> systematic_error)
    : inflation_(inflation(final_fit)), student_(student95(static_cast<double>(blocks) - 1.0)),
      systematic_share_(systematic_share), systematic_error_(std::move(systematic_error)) {}

double IntervalRule::half(const BlockFit& fit, Eigen::Index column, double common, double placed) const {
  if (!fit.usable) return std::numeric_limits<double>::infinity();
  const double floor = 0.7 * inflation_ * fit.model_variance[column];
  const double sd = std::sqrt(std::max(fit.covariance(column, column), floor));
  return std::hypot(student_ * sd, 1.96 * systematic_share_ * common, 1.96 * placed);
}

double IntervalRule::placed(const std::string& effect, const EffectParameter& p) const {
  const auto at = systematic_error_.find(effect);
  return at == systematic_error_.end() ? 0.0 : at->second * p.si_per_unit / p.typical;
}

}  // namespace bodyschema::diagnosis
