#pragma once

#include <Eigen/Core>

namespace bodyschema::diagnosis {

/// How far parameters may move from where they are: low at most 0, high at least 0; infinite where nothing holds them.
struct Bounds {
  Eigen::VectorXd low, high;
};

/// The least of x'Hx / 2 - g'x within bounds: what would leave them furthest is held at its bound, and the rest found
/// anew, until nothing leaves them. (An active set that only grows: what was held once stays so.)
/// @param H  positive definite
Eigen::VectorXd bounded_minimum(const Eigen::MatrixXd& H, const Eigen::VectorXd& g, const Bounds& bounds);

}  // namespace bodyschema::diagnosis
