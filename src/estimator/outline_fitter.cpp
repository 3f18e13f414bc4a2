#include "outline_fitter.hpp"

#include <algorithm>

namespace bodyschema {
namespace {

constexpr double kMaxStep_rad = 0.2;
constexpr double kNear_px[] = {8.0, 4.0};
constexpr double kWide_px[] = {30.0, 20.0, 14.0, 10.0, 7.0, 5.0, 4.0};

/// The cost that the evidence predicts after a change of the state, px^2.
double predicted_cost(const ContourEvidence& evidence, const Eigen::VectorXd& step) {
  return evidence.cost - 2.0 * evidence.b.dot(step) + step.dot(evidence.A * step);
}

}  // namespace

void OutlineFitter::refine(const Observation& observation, const OffsetFusion& memory,
                           std::span<const double> search_px, OutlineFit& fit) {
  for (const double reach_px : search_px) {
    alignment_.linearise(observation, fit.x, reach_px, fit.evidence);
    Eigen::VectorXd step = memory.solve_with(fit.evidence, fit.x, variance_px2()) - fit.x;
    const double largest = step.head(joints_).cwiseAbs().maxCoeff();
    if (largest > kMaxStep_rad) step *= kMaxStep_rad / largest;
    fit.x += step;
  }
  alignment_.linearise(observation, fit.x, search_px.back(), fit.evidence);
}

OutlineFit OutlineFitter::follow(const Observation& observation, const OffsetFusion& memory) {
  OutlineFit fit;
  fit.x = memory.mean();
  refine(observation, memory, kNear_px, fit);
  return fit;
}

OutlineFit OutlineFitter::search(const Observation& observation, std::span<const Eigen::VectorXd> starts) {
  std::vector<OutlineFit> fits(starts.size());
  for (std::size_t i = 0; i < fits.size(); ++i) {
    fits[i].x = starts[i];
    refine(observation, prior_, kWide_px, fits[i]);
    fits[i].distance = scorer_.distance(fits[i].x);
  }
  return std::move(*std::min_element(fits.begin(), fits.end(),
                                     [](const auto& a, const auto& b) { return a.distance < b.distance; }));
}

double OutlineFitter::pull_of(const OutlineFit& fit) const {
  const Eigen::VectorXd alone = prior_.solve_with(fit.evidence, fit.x, variance_px2()) - fit.x;
  return (fit.evidence.cost - predicted_cost(fit.evidence, alone)) / variance_px2();
}

bool OutlineFitter::fits(const ContourEvidence& evidence) const {
  return evidence.sampled > 20 && evidence.matched_share() > 0.6 && evidence.rms_px() < options_.lock_rms_px;
}

}  // namespace bodyschema
