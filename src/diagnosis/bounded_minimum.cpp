#include "bounded_minimum.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

namespace bodyschema::diagnosis {

Eigen::VectorXd bounded_minimum(const Eigen::MatrixXd& H, const Eigen::VectorXd& g, const Bounds& bounds) {
  Eigen::VectorXd x = Eigen::VectorXd::Zero(g.size());
  std::vector<Eigen::Index> free(static_cast<std::size_t>(g.size())), held;
  std::iota(free.begin(), free.end(), Eigen::Index{0});
  while (!free.empty()) {
    const Eigen::MatrixXd own = H(free, free);
    const Eigen::VectorXd pull = g(free) - H(free, held) * x(held), best = own.ldlt().solve(pull);
    x(free) = best;
    const auto beyond = [&](Eigen::Index i) {  // of its bound; 0 where nothing pulls
      const double bound = x[i] > 0.0 ? bounds.high[i] : -bounds.low[i];
      return x[i] == 0.0 ? 0.0 : std::abs(x[i]) / std::abs(bound);
    };
    const auto worst =
        std::max_element(free.begin(), free.end(), [&](auto a, auto b) { return beyond(a) < beyond(b); });
    if (beyond(*worst) <= 1.0) break;
    x[*worst] = std::clamp(x[*worst], bounds.low[*worst], bounds.high[*worst]);
    held.push_back(*worst);
    free.erase(worst);
  }
  return x;
}

}  // namespace bodyschema::diagnosis
