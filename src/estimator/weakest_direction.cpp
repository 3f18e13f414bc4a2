#include "bodyschema/estimator/weakest_direction.hpp"

#include <spdlog/fmt/fmt.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "bodyschema/geometry/pose.hpp"

namespace bodyschema {

WeakestDirection weakest_direction(const Eigen::MatrixXd& covariance_rad2, const std::vector<std::string>& joints) {
  constexpr double kWorthNaming = 0.3;
  WeakestDirection result;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(covariance_rad2);
  result.direction = solver.eigenvectors().col(covariance_rad2.cols() - 1);
  Eigen::Index largest = 0;
  result.direction.cwiseAbs().maxCoeff(&largest);
  if (result.direction(largest) < 0) result.direction = -result.direction;
  result.sd_rad = std::sqrt(std::max(0.0, solver.eigenvalues()(covariance_rad2.cols() - 1)));
  for (std::size_t k = 0; k < joints.size(); ++k) {
    const double share = result.direction(static_cast<Eigen::Index>(k));
    if (std::abs(share) < kWorthNaming) continue;
    const char* sign = share < 0 ? (result.text.empty() ? "-" : " - ") : (result.text.empty() ? "" : " + ");
    result.text += fmt::format("{}{:.2f} {}", sign, std::abs(share), joints[k]);
  }
  result.text += fmt::format(": sd {:.2f} deg", degrees(result.sd_rad));
  return result;
}

}  // namespace bodyschema
