#include "model_fit.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <utility>

namespace bodyschema::diagnosis {
namespace {

constexpr double kUsual_px = 8.0, kWidest_px = 40.0;
constexpr std::size_t kCoarse = 4;  ///< one instant in so many, far from the optimum
constexpr double kNarrow = 0.75;    ///< of the search, a step
constexpr double kReach = 4.0;      ///< the search begins at so many times the typical distance
constexpr double kLost_px2 = 19.0;  ///< cost of a point that left the pictures

std::vector<ParameterRef> fitted_parameters(const ErrorModel& model) {
  std::vector<ParameterRef> list;
  for (std::size_t e = 0; e < model.size(); ++e) {
    for (std::size_t p = 0; p < model[e].parameters().size(); ++p) {
      if (model[e].parameters()[p].fitted) list.push_back({e, p});
    }
  }
  return list;
}

/// Levenberg-Marquardt step in units of typical sizes, with a faint pull to zero so that directions
/// nobody sees stay put; damped further until no parameter goes too far at once.
Eigen::VectorXd damped_step(const ModelFit& at, double damping) {
  constexpr double kFarthest = 6.0;
  const auto n = static_cast<Eigen::Index>(at.all.size());
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(n, n);
  Eigen::VectorXd g = Eigen::VectorXd::Zero(n);
  for (const auto& block : at.statistics->blocks()) {
    H += block.information;
    g += block.vector;
  }
  const Eigen::VectorXd diagonal = H.diagonal();
  const double largest = n > 0 ? std::max(1e-9, diagonal.maxCoeff()) : 1e-9;
  Eigen::VectorXd step = Eigen::VectorXd::Zero(n);
  for (int i = 0; i < 10; ++i) {
    Eigen::MatrixXd damped = H;
    damped.diagonal() += damping * (diagonal.array() + 1e-3 * largest).matrix();
    damped.diagonal().array() += 1e-6 * largest;
    step = damped.ldlt().solve(g);
    const auto known = static_cast<Eigen::Index>(at.parameters.size());
    if (known == 0 || step.head(known).cwiseAbs().maxCoeff() <= kFarthest) break;
    damping = std::max(1e-4, 4.0 * damping);
  }
  return step;
}

void take(ErrorModel& model, const ModelFit& at, double damping) {
  const Eigen::VectorXd step = damped_step(at, damping);
  for (std::size_t c = 0; c < at.parameters.size(); ++c) {
    const auto& ref = at.parameters[c];
    auto& parameter = model[ref.effect].parameters()[ref.parameter];
    parameter.value += step[static_cast<Eigen::Index>(c)] * parameter.typical;
    if (model[ref.effect].name() == "backlash") parameter.value = std::max(parameter.value, 1e-5);
  }
}

/// Which steps are taken, and how far they may go.
struct Pace {
  double cost;
  double damping = 0.0;
  int retreats = 0;

  /// Whether a step that led to this cost is taken; if not, the next one is to be shorter.
  bool accepts(double new_cost) {
    constexpr double kWorse = 1e-3;  // share: points of an outline come and go
    if (!(new_cost <= (1.0 + kWorse) * cost)) {
      ++retreats;
      damping = std::max(1e-3, 10.0 * damping);
      return false;
    }
    cost = new_cost;
    retreats = 0;
    damping = damping > 1e-3 ? 0.1 * damping : 0.0;
    return true;
  }
  [[nodiscard]] bool stuck() const { return retreats > 4; }
};

}  // namespace

double outline_points(const Linearisation& at) {
  double points = 0.0;
  for (const auto& view : at.views) points += view.outline;
  return points;
}

double misfit(const Linearisation& at, double outline) {
  double cost = 0.0;
  for (const auto& view : at.views) cost += view.misfit;
  const double points = outline_points(at);
  // Some of the outline always comes and goes; much of it gone is no better fit.
  constexpr double kUsualLoss = 0.1;
  const double lost = std::max(0.0, (1.0 - kUsualLoss) * outline - points);
  return (cost + kLost_px2 * lost) / std::max(1.0, points + lost);
}

double typical_distance_px(double misfit) {
  return misfit > 1.0 ? 0.5 * (misfit + 1.0) : std::sqrt(std::max(0.0, misfit));
}

void go_half_way(const ErrorModel& other, ErrorModel& model) {
  for (std::size_t e = 0; e < model.size(); ++e) {
    for (std::size_t p = 0; p < model[e].parameters().size(); ++p) {
      auto& value = model[e].parameters()[p].value;
      value = 0.5 * (value + other[e].parameters()[p].value);
    }
  }
}

ModelFit ModelFitter::regress(const ErrorModel& model, const std::vector<const SparseColumn*>& extra) {
  return regress(model, linearise(source_, model), extra);
}

ModelFit ModelFitter::regress(const ErrorModel& model, Linearisation at,
                              const std::vector<const SparseColumn*>& extra) {
  ModelFit result;
  result.at = std::move(at);
  if (!plan_) plan_ = plan_blocks(source_, result.at.views, block_s_);
  result.parameters = fitted_parameters(model);
  std::vector<std::unique_ptr<Effect>> effects;
  for (std::size_t e = 0; e < model.size(); ++e) effects.push_back(model[e].clone());
  result.columns = effect_columns(source_, result.at, effects, layout_);
  accumulate_on(extra, result);
  return result;
}

ModelFit ModelFitter::about(const ErrorModel& model, const std::vector<const SparseColumn*>& extra) {
  source_.set_search(finest_px_);
  return regress(model, extra);
}

ModelFit ModelFitter::fit(ErrorModel& model, const std::vector<const SparseColumn*>& extra, const Settings& settings) {
  constexpr double kSmall = 2e-3;  // of a parameter's typical size
  if (settings.from_afar) approach(model, extra);
  source_.set_search(finest_px_, settings.every);
  auto accepted = regress(model, extra);
  const double outline = outline_points(accepted.at);
  Pace pace{misfit(accepted.at, outline)};
  for (int i = 0; i < settings.iterations;) {
    // Extra columns stay beside the model: what they ask for never shrinks.
    const auto known = static_cast<Eigen::Index>(accepted.parameters.size());
    if (known == 0 || damped_step(accepted, pace.damping).head(known).cwiseAbs().maxCoeff() < kSmall) break;
    auto moved = model;
    take(moved, accepted, pace.damping);
    auto at = linearise(source_, moved);
    if (!pace.accepts(misfit(at, outline))) {
      if (pace.stuck()) break;
      continue;
    }
    accepted = regress(moved, std::move(at), extra);
    model = std::move(moved);
    ++i;
    if (settings.progress) settings.progress(static_cast<double>(i) / settings.iterations);
  }
  return accepted;
}

double ModelFitter::approach(ErrorModel& model, const std::vector<const SparseColumn*>& extra, double from_px) {
  if (!source_.set_search(kUsual_px, kCoarse)) return 0.0;
  auto at = linearise(source_, model);
  const double outline = outline_points(at);
  double best_cost = misfit(at, outline);
  auto best = model;
  double search_px =
      std::clamp(kReach * typical_distance_px(best_cost), std::max({kUsual_px, finest_px_, from_px}), kWidest_px);
  // From afar the way to the outlines may lead over worse places: every step is taken, the best kept.
  auto trial = model;
  while (true) {
    source_.set_search(search_px, kCoarse);
    take(trial, regress(trial, extra), 0.0);
    const double cost = misfit(linearise(source_, trial), outline);
    if (cost < best_cost) {
      best_cost = cost;
      best = trial;
    }
    if (search_px <= finest_px_) break;
    search_px = std::max(finest_px_, kNarrow * search_px);
  }
  model = std::move(best);
  return typical_distance_px(best_cost);
}

void ModelFitter::accumulate_on(const std::vector<const SparseColumn*>& extra, ModelFit& at) const {
  std::vector<const SparseColumn*> pointers;
  for (const auto& column : at.columns) pointers.push_back(&column);
  at.extra.clear();
  for (const auto* column : extra) at.extra.push_back(*column);
  for (const auto& column : at.extra) pointers.push_back(&column);
  at.all.clear();
  for (Eigen::Index c = 0; c < static_cast<Eigen::Index>(pointers.size()); ++c) {
    at.all.push_back({c, 0});
  }
  at.statistics.emplace(accumulate(at.at.views, *plan_, pointers));
  at.fit = at.statistics->fit(at.all);
}

}  // namespace bodyschema::diagnosis
