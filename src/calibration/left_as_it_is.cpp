#include "left_as_it_is.hpp"

#include <Eigen/Cholesky>
#include <algorithm>

namespace bodyschema {
namespace {

constexpr double kHeld = 1e-3;  ///< of a belief's standard deviation: next to nothing

std::vector<Eigen::Index> parameters_of(const State& state, const std::vector<std::size_t>& effects) {
  std::vector<Eigen::Index> list;
  for (Eigen::Index k = 0; k < state.size(); ++k) {
    const auto effect = state.parameters()[static_cast<std::size_t>(k)].ref.effect;
    if (std::find(effects.begin(), effects.end(), effect) != effects.end()) list.push_back(k);
  }
  return list;
}

/// How the whole estimate moves where some of its parameters are moved by so much.
Eigen::VectorXd moved_along(const Eigen::MatrixXd& covariance, const std::vector<Eigen::Index>& own,
                            const Eigen::VectorXd& by) {
  const Eigen::MatrixXd C = covariance(own, own);
  Eigen::VectorXd moved = covariance(Eigen::all, own) * C.ldlt().solve(by);
  moved(own) = by;
  return moved;
}

}  // namespace

std::vector<std::size_t> left_as_they_are(const State& state, const MemoryEstimate& estimate,
                                          std::vector<std::size_t> untold) {
  while (!untold.empty()) {
    const auto own = parameters_of(state, untold);
    const Eigen::VectorXd away = (state.prior_mean() - estimate.x)(own);
    const Eigen::MatrixXd C = estimate.covariance(own, own);
    const double distance = away.dot(C.ldlt().solve(away));
    if (distance <= static_cast<double>(own.size())) break;
    Eigen::Index furthest = 0;
    away.cwiseAbs().cwiseQuotient(C.diagonal().cwiseSqrt()).maxCoeff(&furthest);
    const auto worst = own[static_cast<std::size_t>(furthest)];
    std::erase(untold, state.parameters()[static_cast<std::size_t>(worst)].ref.effect);
  }
  return untold;
}

Eigen::VectorXd given_as_believed(const State& state, const MemoryEstimate& estimate,
                                  const std::vector<std::size_t>& effects) {
  const auto own = parameters_of(state, effects);
  return estimate.x + moved_along(estimate.covariance, own, (state.prior_mean() - estimate.x)(own));
}

Eigen::VectorXd beside(const State& state, const MemoryEstimate& estimate, const std::vector<std::size_t>& effects,
                       const Eigen::VectorXd& change) {
  const auto own = parameters_of(state, effects);
  return change - moved_along(estimate.covariance, own, change(own));
}

std::vector<Belief> held_as_believed(std::vector<Belief> beliefs, const State& state,
                                     const std::vector<std::size_t>& effects) {
  for (auto& belief : beliefs) {
    const bool held = std::any_of(effects.begin(), effects.end(), [&](std::size_t e) {
      const Effect& effect = state.model()[e];
      return effect.name() == belief.effect && effect.target() == belief.target;
    });
    if (!held) continue;
    for (double& sd : belief.sd) sd *= kHeld;
  }
  return beliefs;
}

}  // namespace bodyschema
