#include "bodyschema/estimator/estimate.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>

namespace bodyschema {

const char* to_string(EstimatorState state) {
  switch (state) {
    case EstimatorState::kLearningBackground: return "learning_background";
    case EstimatorState::kHandNotInView: return "hand_not_in_view";
    case EstimatorState::kConverging: return "converging";
    case EstimatorState::kConverged: return "converged";
    case EstimatorState::kDiverged: return "diverged";
    case EstimatorState::kModelMisfit: return "model_misfit";
    case EstimatorState::kOccluded: return "occluded";
  }
  return "unknown";
}

const char* to_string(FrameVerdict verdict) {
  switch (verdict) {
    case FrameVerdict::kNothingKnown: return "nothing_known";
    case FrameVerdict::kAgrees: return "agrees";
    case FrameVerdict::kDoubtful: return "doubtful";
    case FrameVerdict::kContradicts: return "contradicts";
  }
  return "unknown";
}

std::string HiddenShare::text() const {
  constexpr double kWorthAWord = 0.15;
  std::string text;
  if (hand >= kWorthAWord) text = fmt::format("{:.0f} % of the hand is hidden", 100.0 * hand);
  if (hand < kWorthAWord && robot >= kWorthAWord) text = fmt::format("{:.0f} % of the arm is hidden", 100.0 * robot);
  if (holds) text += text.empty() ? "the hand holds something" : ", it holds something";
  return text;
}

std::string Finding::text() const {
  std::string text = effect;
  if (effect == "unexplained") return fmt::format("something that follows the {} of {}", source, joint);
  if (!joint.empty()) text += " of " + joint;
  if (!source.empty()) text += (joint.empty() ? " " : " with ") + source;
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const auto& p = parameters[i];
    text += fmt::format("{} {:.3g} {}", i > 0 ? "," : "", p.value, p.unit);
  }
  for (std::size_t i = 0; i < alike.size(); ++i) text += (i == 0 ? ", or " : " or ") + alike[i];
  return text;
}

bool Estimate::told(std::size_t joint) const {
  constexpr double kTold_rad = 0.5 * kPi / 180.0;
  if (state == EstimatorState::kModelMisfit) return false;
  const auto k = static_cast<Eigen::Index>(joint);
  const double sd = std::sqrt(std::max(0.0, covariance_rad2(k, k)));
  return sd < kTold_rad && (prior_sd_rad.size() <= k || sd < prior_sd_rad(k) / 3.0);
}

}  // namespace bodyschema
