#include "convergence.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>

#include "limits.hpp"

namespace bodyschema {
namespace {

/// Where a configuration says what is believed of an effect.
const char* believed_at(const std::string& effect) {
  return effect == "camera_pose" || effect == "camera_pair" ? "pose_sd_mm and pose_sd_deg of cameras"
                                                            : "estimator.state";
}

}  // namespace

double hand_sd_limit_m(const EstimatorOptions& options, const State& state, const HandUncertainty& hand,
                       double pixel_m) {
  if (options.converged_hand_sd_m > 0.0) return options.converged_hand_sd_m;
  constexpr double kMore = 1.5;
  const double own_m =
      std::min(limits::kMostHand_px * pixel_m,
               std::hypot(limits::kHand_px * pixel_m, limits::kOfDescription * hand.described_sd_m(state)));
  return std::hypot(own_m, kMore * hand.tolerated_sd_m());
}

std::string misfit(const PostureMemory& memory, const State& state) {
  const auto& known = memory.estimate();
  const Eigen::VectorXd prior_sd = memory.layout().prior_sd;
  const Eigen::VectorXd away = (known.x - memory.layout().prior_mean).cwiseQuotient(prior_sd);
  Eigen::Index worst = -1;
  for (Eigen::Index k = state.joints(); k < away.size(); ++k) {
    if (std::abs(away[k]) > limits::kBeyondBelief_sd && (worst < 0 || std::abs(away[k]) > std::abs(away[worst]))) {
      worst = k;
    }
  }
  if (worst >= 0) {
    const auto& p = state.parameters()[static_cast<std::size_t>(worst)];
    return fmt::format(
        "the pictures ask for {} {:.3g} {}, {:.0f} times what is believed possible ({}): it is further off than that, "
        "or something else is wrong with the model: run bodyschema diagnose on a log",
        p.name, known.x[worst] / p.si_per_unit, p.unit, std::abs(away[worst]),
        believed_at(state.model()[p.ref.effect].name()));
  }
  if (memory.dispersion() > limits::kDisagreement) {
    return fmt::format(
        "postures disagree by {:.1f} times what is claimed; the model of the robot is wrong in a way that offsets do "
        "not explain: run bodyschema diagnose on a log",
        std::sqrt(memory.dispersion()));
  }
  return {};
}

EstimatorState conclude(const FrameOutcome& outcome, const FusedState& known, const State& state, bool knows_shape,
                        Estimate& estimate) {
  if (outcome.state != EstimatorState::kConverging || known.unsure()) return outcome.state;
  estimate.misfit = misfit(known.memory, state);
  // Known by the memory alone, whatever it claims: nobody sees whether it still holds.
  if (outcome.hidden.hand > limits::kMostHidden || (outcome.hidden_only && !outcome.near)) {
    return EstimatorState::kOccluded;
  }
  if (!estimate.misfit.empty()) return EstimatorState::kModelMisfit;
  const bool sure = !outcome.contradicted && outcome.near && outcome.verdict == FrameVerdict::kAgrees &&
                    !known.stalled.suspected() && knows_shape && estimate.hand_sd_m < estimate.hand_sd_limit_m;
  return sure ? EstimatorState::kConverged : EstimatorState::kConverging;
}

}  // namespace bodyschema
