#include "bodyschema/filter/kernel_density.hpp"

#include <cmath>

namespace bodyschema {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kDegreesPerRadian = 180.0 / kPi;
constexpr double kCutoffSd = 7.0;

}  // namespace

double kernel(double squared_distance_deg2, double sd_deg, Eigen::Index dimension) {
  const double determinant = std::pow(sd_deg, 2.0 * static_cast<double>(dimension));
  return std::exp(-0.5 * squared_distance_deg2 / (sd_deg * sd_deg)) / std::sqrt(2.0 * kPi * determinant);
}

void kernel_density(const Eigen::MatrixXd& states_rad, const Eigen::VectorXd& likelihood, double sd_deg,
                    Eigen::VectorXd& kde) {
  const Eigen::Index n = states_rad.cols();
  const Eigen::Index dimension = states_rad.rows();
  const double peak = kernel(0.0, sd_deg, dimension);
  const double scale = kDegreesPerRadian * kDegreesPerRadian / (sd_deg * sd_deg);
  kde = likelihood * peak;  // every particle is its own neighbour
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < i; ++j) {
      double squared = 0.0;
      for (Eigen::Index k = 0; k < dimension; ++k) {
        const double difference = states_rad(k, i) - states_rad(k, j);
        squared += difference * difference;
      }
      squared *= scale;
      if (squared > kCutoffSd * kCutoffSd) continue;
      const double value = peak * std::exp(-0.5 * squared);
      kde(i) += likelihood(j) * value;
      kde(j) += likelihood(i) * value;
    }
  }
  kde /= static_cast<double>(n);
}

Eigen::Index densest_particle(const Eigen::VectorXd& likelihood, const Eigen::VectorXd& kde, double alpha) {
  Eigen::Index best = 0;
  double best_weight = -1.0;
  for (Eigen::Index i = 0; i < likelihood.size(); ++i) {
    const double weight = likelihood(i) + alpha * kde(i);
    if (weight > best_weight) {
      best_weight = weight;
      best = i;
    }
  }
  return best;
}

}  // namespace bodyschema
