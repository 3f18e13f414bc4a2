#include "section_spread.hpp"

#include <cmath>

#include "bodyschema/evidence/distributions.hpp"

namespace bodyschema {
namespace {

constexpr std::size_t kFewestSections = 3;
/// Statistical: one parameter in a hundred is widened though all is as claimed.
constexpr double kChance = 0.01;

}  // namespace

Eigen::VectorXd section_spread(const std::vector<Eigen::VectorXd>& without, const Eigen::VectorXd& sd) {
  Eigen::VectorXd factor = Eigen::VectorXd::Ones(sd.size());
  if (without.size() < kFewestSections) return factor;
  const auto count = static_cast<double>(without.size());
  Eigen::VectorXd mean = Eigen::VectorXd::Zero(sd.size());
  for (const auto& x : without) mean += x / count;
  Eigen::VectorXd variance = Eigen::VectorXd::Zero(sd.size());
  for (const auto& x : without) variance += (x - mean).cwiseAbs2() * ((count - 1.0) / count);
  const double limit = chi_square_quantile(kChance, count - 1.0) / (count - 1.0);
  for (Eigen::Index k = 0; k < sd.size(); ++k) {
    if (sd[k] <= 0.0) continue;
    const double ratio = variance[k] / (sd[k] * sd[k]);
    if (ratio > limit) factor[k] = std::sqrt(ratio);
  }
  return factor;
}

}  // namespace bodyschema
