#include "section_spread.hpp"

#include <algorithm>
#include <cmath>

#include "bodyschema/evidence/distributions.hpp"

namespace bodyschema {
namespace {

constexpr std::size_t kFewestSections = 3;
/// Statistical: one parameter in a hundred is widened though all is as claimed.
constexpr double kChance = 0.01;

}  // namespace

Eigen::VectorXd section_spread(const std::vector<Eigen::VectorXd>& without, const Eigen::VectorXd& sd,
                               std::span<const Eigen::Index> told, double prior_directions) {
  Eigen::VectorXd factor = Eigen::VectorXd::Ones(sd.size());
  if (without.size() < kFewestSections) return factor;
  const auto count = static_cast<double>(without.size());
  Eigen::VectorXd mean = Eigen::VectorXd::Zero(sd.size());
  for (const auto& x : without) mean += x / count;
  Eigen::VectorXd ratio = Eigen::VectorXd::Zero(sd.size());  // of variances
  for (const auto& x : without) ratio += (x - mean).cwiseAbs2() * ((count - 1.0) / count);
  for (Eigen::Index k = 0; k < sd.size(); ++k) ratio[k] = sd[k] > 0.0 ? ratio[k] / (sd[k] * sd[k]) : 0.0;
  if (!told.empty()) {
    double sum = 0.0;
    for (const auto k : told) sum += ratio[k];
    const double directions = (count - 1.0) * static_cast<double>(told.size());
    const double together = (prior_directions + (count - 1.0) * sum) / (prior_directions + directions);
    for (const auto k : told) factor[k] = std::sqrt(std::max(1.0, together));
  }
  const double limit = chi_square_quantile(kChance, count - 1.0) / (count - 1.0);
  for (Eigen::Index k = 0; k < sd.size(); ++k) {
    if (ratio[k] > limit) factor[k] = std::max(factor[k], std::sqrt(ratio[k]));
  }
  return factor;
}

}  // namespace bodyschema
