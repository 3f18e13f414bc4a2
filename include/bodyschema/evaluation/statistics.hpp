#pragma once

#include <Eigen/Core>
#include <vector>

namespace bodyschema {

/// Mean, sample standard deviation, median and largest of a list; zeros for an empty one.
struct Statistics {
  double mean = 0.0;
  double sd = 0.0;
  double median = 0.0;
  double worst = 0.0;
  static Statistics of(std::vector<double> values);
};

/// Length of an error in standard deviations, by its covariance in the same unit squared (Mahalanobis distance).
/// Infinite for a covariance that is not positive definite.
double distance_sd(const Eigen::Vector3d& error, const Eigen::Matrix3d& covariance);

}  // namespace bodyschema
