#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

namespace bodyschema {

/// The combination of joint offsets that the pictures say least about: unit vector over the
/// estimated joints and its standard deviation.
struct WeakestDirection {
  Eigen::VectorXd direction;
  double sd_rad = 0.0;
  /// "0.71 r_wrist_prosup - 0.70 r_wrist_pitch: sd 0.4 deg"
  std::string text;
};

/// @param covariance_rad2  of the joint offsets, as wide as `joints`
/// @return the direction of its largest eigenvalue, the largest component positive; joints with less
///   than 0.3 of it are left out of the text
WeakestDirection weakest_direction(const Eigen::MatrixXd& covariance_rad2, const std::vector<std::string>& joints);

}  // namespace bodyschema
