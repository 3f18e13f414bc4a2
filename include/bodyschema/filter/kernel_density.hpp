#pragma once

#include <Eigen/Core>

namespace bodyschema {

/// Gaussian kernel of equation (7) with Sigma = sd^2 I, in degrees, with the paper's own
/// normalisation 1 / sqrt(2 pi |Sigma|) (the dimension does not enter the power of 2 pi):
/// K = exp(-r^2 / (2 sd^2)) / sqrt(2 pi sd^(2 m)), m the number of joints.
double kernel(double squared_distance_deg2, double sd_deg, Eigen::Index dimension);

/// KDE_i = (1/n) sum_j L_j K(x_i - x_j), equation (6), for every particle i.
///
/// @param states_rad  one particle per column, radians
/// @param likelihood  L, one per particle
/// @param kde  out, one per particle
/// Pairs further apart than `kCutoffSd` standard deviations contribute less than 1e-10 of the peak
/// and are skipped.
void kernel_density(const Eigen::MatrixXd& states_rad, const Eigen::VectorXd& likelihood, double sd_deg,
                    Eigen::VectorXd& kde);

/// The particle with the largest W_i = L_i + alpha KDE_i, equation (5).
Eigen::Index densest_particle(const Eigen::VectorXd& likelihood, const Eigen::VectorXd& kde, double alpha);

}  // namespace bodyschema
