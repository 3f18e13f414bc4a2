#include "bodyschema/evidence/variance_components.hpp"

#include <Eigen/Cholesky>
#include <cmath>

namespace bodyschema {
namespace {

/// Numerical. Standard deviations that are tried, in units: as if zero, beyond what an arm can be, and 25 in all.
constexpr double kLeast = 0.05, kMost = 50.0;
constexpr int kTried = 25;

/// Twice the logarithm of the likelihood of standard deviations, one of each parameter; but for a constant.
double likelihood(const Quadratic& evidence, const Eigen::VectorXd& sd) {
  const auto n = evidence.b.size();
  const Eigen::VectorXd b = sd.cwiseProduct(evidence.b);
  const Eigen::LLT<Eigen::MatrixXd> llt(Eigen::MatrixXd::Identity(n, n) +
                                        sd.asDiagonal() * evidence.A * sd.asDiagonal());
  return b.dot(llt.solve(b)) - 2.0 * llt.matrixLLT().diagonal().array().log().sum();
}

}  // namespace

MeasuredComponents measure_components(const Quadratic& evidence, std::span<const VarianceComponent> components) {
  const auto count = static_cast<Eigen::Index>(components.size());
  Eigen::VectorXd each = Eigen::VectorXd::Ones(evidence.b.size());
  const auto assign = [&](std::size_t component, double sd) {
    for (const auto k : components[component]) each[k] = sd;
  };
  for (std::size_t c = 0; c < components.size(); ++c) assign(c, 0.0);
  const double nothing = likelihood(evidence, each);
  MeasuredComponents result{Eigen::VectorXd::Zero(count), 0.0};
  if (count == 0) return result;
  double weight = 0.0, believed = 0.0, most = 0.0;  // the first in units of exp(most), which may be anything
  std::vector<int> tried(components.size(), 0);
  for (bool more = true; more;) {
    Eigen::VectorXd sd(count);
    double log_prior = 0.0;
    for (std::size_t c = 0; c < components.size(); ++c) {
      const double own = kLeast * std::pow(kMost / kLeast, tried[c] / (kTried - 1.0));
      sd[static_cast<Eigen::Index>(c)] = own;
      assign(c, own);
      log_prior += std::log(own / (1.0 + own * own));  // half Cauchy, on a grid of equal ratios
    }
    const double gain = 0.5 * (likelihood(evidence, each) - nothing);
    if (gain > most) {
      const double less = std::exp(most - gain);
      weight *= less;
      result.sd *= less;
      most = gain;
    }
    const double own = std::exp(gain - most + log_prior);
    weight += own;
    result.sd += own * sd.cwiseAbs2();
    believed += std::exp(log_prior);
    std::size_t c = 0;
    while (c < tried.size() && ++tried[c] == kTried) tried[c++] = 0;
    more = c < tried.size();
  }
  result.sd = (result.sd / weight).cwiseSqrt();
  result.log_odds = most + std::log(weight / believed);
  return result;
}

}  // namespace bodyschema
