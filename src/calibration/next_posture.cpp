#include "next_posture.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <random>
#include <vector>

namespace bodyschema {
namespace {

constexpr int kDrawnPostures = 300;   ///< that are drawn
constexpr double kBeyond_rad = 0.35;  ///< beyond what was recorded, a joint goes no further: who knows what is there
constexpr double kInView = 0.6;       ///< of the outline that recorded pictures show
constexpr double kWorthIt = 0.9;      ///< of the standard deviation that is left

}  // namespace

std::optional<NextPosture> next_posture(LogFit& fit, const BatchFit& batch, const RobotSetup& setup) {
  auto& log = fit.log();
  const auto& roles = log.roles();
  const auto& state = batch.state();
  const auto n = state.size();
  const auto refs = state.refs();
  EffectProbes probes(state.model(), refs, fit.coordinates());
  const auto active = fit.moved_by(state.model(), refs);
  std::vector<Eigen::Index> position(static_cast<std::size_t>(fit.coordinates().size()), -1);
  for (std::size_t i = 0; i < active.size(); ++i) position[active[i]] = static_cast<Eigen::Index>(i);

  Eigen::VectorXd low = log.pictures().front().joints.q, high = low;
  double usual_outline = 0.0;
  for (std::size_t p = 0; p < log.pictures().size(); ++p) {
    low = low.cwiseMin(log.pictures()[p].joints.q);
    high = high.cwiseMax(log.pictures()[p].joints.q);
    usual_outline = std::max(usual_outline, batch.at().evidence[p].sampled);
  }
  const auto joints = log.robot()->joints();
  std::mt19937_64 random(1);
  const Eigen::MatrixXd precision = batch.estimate().covariance.inverse();
  const Eigen::VectorXd sd = batch.estimate().covariance.diagonal().head(state.joints()).cwiseMax(0.0).cwiseSqrt();
  struct Trial {
    Eigen::VectorXd q, sd;
  };
  std::vector<Trial> trials;
  auto& measurement = fit.measurement();
  OutlineEvidence evidence;
  std::vector<Direction> directions;
  Instant at;
  at.qdot = at.qddot = Eigen::VectorXd::Zero(low.size());
  Corrections corrections = roles.no_corrections();
  for (int i = 0; i < kDrawnPostures; ++i) {
    Trial trial{log.pictures().front().joints.q, {}};
    for (const auto j : roles.arm) {
      const auto& info = joints[static_cast<std::size_t>(j)];
      const double from = std::max(info.lower_rad, low[j] - kBeyond_rad),
                   to = std::min(info.upper_rad, high[j] + kBeyond_rad);
      trial.q[j] = std::uniform_real_distribution<double>(std::min(from, to), to)(random);
    }
    Eigen::MatrixXd A = Eigen::MatrixXd::Zero(n, n);
    bool in_view = false;
    for (std::size_t c = 0; c < log.rig().cameras.size(); ++c) {
      at.camera = c;
      at.encoder = trial.q;
      at.q = trial.q - state.model().offsets();
      state.model().corrections(at, corrections);
      measurement.expect(trial.q, corrections, c, active, batch.search(), evidence);
      const auto& hand = measurement.projection().hand();
      const auto& k = log.rig().cameras[c].intrinsics;
      const Eigen::Vector2d pixel = k.project(hand.translation());
      const bool seen = hand.translation().z() > 0.05 && pixel.x() > 0 && pixel.y() > 0 && pixel.x() < k.width &&
                        pixel.y() < k.height && evidence.sampled > kInView * usual_outline;
      if (!seen) continue;
      in_view = true;
      probes.directions(at, directions);
      Eigen::MatrixXd J = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(active.size()), n);
      for (std::size_t p = 0; p < directions.size(); ++p) {
        for (const auto& step : directions[p]) J(position[step.coordinate], static_cast<Eigen::Index>(p)) = step.amount;
      }
      const double unit = picture_unit(k);
      A += J.transpose() * evidence.A * J / (unit * unit * batch.noise()[c].variance_px2());
    }
    if (!in_view) continue;
    trial.sd = (precision + A).inverse().diagonal().head(state.joints()).cwiseMax(0.0).cwiseSqrt();
    trials.push_back(std::move(trial));
  }
  // The worst joint that a posture can help.
  std::vector<Eigen::Index> order(static_cast<std::size_t>(state.joints()));
  for (Eigen::Index j = 0; j < state.joints(); ++j) order[static_cast<std::size_t>(j)] = j;
  std::sort(order.begin(), order.end(), [&](auto a, auto b) { return sd[a] > sd[b]; });
  for (const auto j : order) {
    const auto best =
        std::min_element(trials.begin(), trials.end(), [j](const auto& a, const auto& b) { return a.sd[j] < b.sd[j]; });
    if (best == trials.end() || best->sd[j] > kWorthIt * sd[j]) continue;
    NextPosture next;
    next.tells = state.parameters()[static_cast<std::size_t>(j)].name;
    for (const auto& name : setup.estimated_joints) next.joints_rad[name] = best->q[log.robot()->joint_index(name)];
    return next;
  }
  return std::nullopt;
}

}  // namespace bodyschema
