#include "nearer_model.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "bodyschema/core/seeded_random.hpp"
#include "bodyschema/effects/catalogue.hpp"

namespace bodyschema::diagnosis {
namespace {

constexpr int kMostCauses = 3;
constexpr std::size_t kTried = 5;  ///< for real, of all: the best by a linear estimate
constexpr double kBetter = 0.85;   ///< of the misfit, for a further cause
const ModelFitter::Settings kRough{.iterations = 5, .progress = {}, .every = 4, .from_afar = false};

/// Causes that are tried together.
using Idea = std::vector<CauseName>;

struct Guess {
  ErrorModel model;
  double misfit;
};

/// When a slip is best switched on: before it the views as they are without, from it on as they are with it all the
/// time.
/// @param slip  its position in the model
double switching_time_s(MeasurementSource& source, ErrorModel model, std::size_t slip) {
  const auto parameters = model[slip].parameters();
  parameters[1].value = 0.0;
  const auto with = linearise(source, model);
  parameters[0].value = 0.0;
  const auto without = linearise(source, model);
  double running = 0.0, least = 0.0;
  double best = seconds(source.views().front().joints.utime);
  for (std::size_t v = 0; v < without.views.size(); ++v) {
    running += without.views[v].misfit - with.views[v].misfit;
    if (running >= least) continue;
    least = running;
    best = seconds(source.views()[v].joints.utime) + 1e-4;
  }
  return best;
}

/// The last effect's first parameter, a slip's step, at the best of several: the outlines may lie further off than any
/// search looks.
void begin_at_best_step(MeasurementSource& source, ErrorModel& model) {
  constexpr double kLargest_rad = 18.0 * kPi / 180.0, kFar_px = 10.0;
  constexpr int kSteps = 6;  // to either side
  constexpr std::size_t kEvery = 16;
  if (!source.set_search(kFar_px, kEvery)) return;
  const std::size_t slip = model.size() - 1;
  const double outline = outline_points(linearise(source, model));
  double best_step = 0.0, least = std::numeric_limits<double>::infinity();
  for (int i = -kSteps; i <= kSteps; ++i) {
    const double step = kLargest_rad * i / kSteps;
    model[slip].parameters()[0].value = step;
    const double cost = misfit(linearise(source, model), outline);
    if (cost >= least) continue;
    least = cost;
    best_step = step;
  }
  model[slip].parameters()[0].value = best_step;
}

class NearerModel {
 public:
  NearerModel(MeasurementSource& source, const CoordinateLayout& layout, ModelFitter& fitter,
              const std::vector<CauseName>& causes)
      : source_(source), layout_(layout), fitter_(fitter), causes_(causes) {}

  std::optional<ErrorModel> from(const ErrorModel& offsets) {
    Guess best{offsets, 0.0};
    auto fit = fitter_.fit(best.model, {}, kRough);
    outline_ = outline_points(fit.at);
    best.misfit = misfit(fit.at, outline_);
    bool nearer = false;
    for (int round = 0; round < kMostCauses; ++round) {
      auto ideas = promising(best.model, fit);
      if (round == 0) ideas.push_back(lengths());
      auto guess = best_of(ideas, best.model);
      if (!guess || guess->misfit > kBetter * best.misfit) break;
      best = std::move(*guess);
      fit = fitter_.fit(best.model, {}, kRough);
      nearer = true;
    }
    if (!nearer) return std::nullopt;
    return best.model;
  }

 private:
  /// The causes that promise most, by the loss that a linear estimate leaves.
  [[nodiscard]] std::vector<Idea> promising(ErrorModel& model, const ModelFit& fit) const {
    std::vector<CauseName> names;
    std::vector<std::unique_ptr<Effect>> effects;
    for (const auto& cause : causes_) {
      const EffectTarget target{cause.joint, cause.source};
      if (model.find(cause.name, target) != nullptr) continue;
      names.push_back(cause);
      effects.push_back(make_effect(cause.name, target, source_.roles()));
    }
    const auto more = effect_columns(source_, fit.at, effects, layout_);
    std::vector<const SparseColumn*> pointers;
    for (const auto& column : fit.columns) pointers.push_back(&column);
    for (const auto& column : more) pointers.push_back(&column);
    const auto statistics = accumulate(fit.at.views, fitter_.plan(), pointers);
    const NestedFits nested(statistics, fit.all);
    std::vector<std::pair<double, std::size_t>> left;
    auto next = static_cast<Eigen::Index>(fit.columns.size());
    for (std::size_t e = 0; e < effects.size(); ++e) {
      Columns columns;
      for (const auto& p : std::as_const(*effects[e]).parameters()) {
        if (p.fitted) columns.push_back({next++});
      }
      const auto extended = nested.with(columns);
      if (extended.usable) left.emplace_back(extended.loss, e);
    }
    std::sort(left.begin(), left.end());
    std::vector<Idea> best;
    for (std::size_t i = 0; i < std::min(kTried, left.size()); ++i) best.push_back({names[left[i].second]});
    return best;
  }

  /// Lengths between base and hand. Which of them the log asks for is decided where all of it is
  /// looked at.
  [[nodiscard]] Idea lengths() const {
    Idea idea;
    for (const auto& cause : causes_) {
      const auto& name = cause.name;
      if (name == "base_shift" || name == "link_length" || name == "axis_shift") idea.push_back(cause);
    }
    return idea;
  }

  [[nodiscard]] std::optional<Guess> best_of(const std::vector<Idea>& ideas, const ErrorModel& model) {
    std::optional<Guess> best;
    for (const auto& idea : ideas) {
      Guess guess{model, 0.0};
      for (const auto& cause : idea) guess.model.add(cause.name, {cause.joint, cause.source});
      guess.misfit = misfit(fitter_.fit(guess.model, {}, kRough).at, outline_);
      if (plausible(guess.model) && (!best || guess.misfit < best->misfit)) best = std::move(guess);
    }
    return best;
  }

  MeasurementSource& source_;
  const CoordinateLayout& layout_;
  ModelFitter& fitter_;
  const std::vector<CauseName>& causes_;
  double outline_ = 0.0;
};

}  // namespace

std::vector<ErrorModel> scattered_starts(MeasurementSource& source, const ErrorModel& offsets) {
  constexpr int kDrawn = 150;
  constexpr std::size_t kKept = 3, kEvery = 16;
  constexpr double kSpread_rad = 10.0 * kPi / 180.0, kFar_px = 10.0;
  if (!source.set_search(kFar_px, kEvery)) return {};
  const double outline = outline_points(linearise(source, offsets));
  SeededRandom random(1);
  std::vector<Guess> guesses;
  for (int i = 0; i < kDrawn; ++i) {
    Guess guess{offsets, 0.0};
    for (std::size_t e = 0; e < guess.model.size(); ++e) {
      guess.model[e].parameters()[0].value = kSpread_rad * random.normal();
    }
    guess.misfit = misfit(linearise(source, guess.model), outline);
    guesses.push_back(std::move(guess));
  }
  std::sort(guesses.begin(), guesses.end(), [](const auto& a, const auto& b) { return a.misfit < b.misfit; });
  std::vector<ErrorModel> starts;
  for (std::size_t i = 0; i < kKept; ++i) starts.push_back(std::move(guesses[i].model));
  return starts;
}

std::optional<Turning> turning(const MeasurementSource& source, const Linearisation& at) {
  constexpr double kLeast_px2 = 1e-3;
  std::vector<double> time_s, cost;
  for (std::size_t v = 0; v < at.views.size(); ++v) {
    const auto& view = at.views[v];
    if (view.outline <= 0.0) continue;
    time_s.push_back(seconds(source.views()[v].joints.utime));
    cost.push_back(view.misfit / view.outline);
  }
  const auto all = static_cast<double>(cost.size());
  const double mean = std::accumulate(cost.begin(), cost.end(), 0.0) / std::max(1.0, all);
  double most = 0.0, before = 0.0;
  std::optional<Turning> best;
  for (std::size_t v = 1; v < cost.size(); ++v) {
    before += cost[v - 1] - mean;
    const auto n = static_cast<double>(v);
    const double apart = before * before * (1.0 / n + 1.0 / (all - n));
    if (apart <= most || time_s[v] <= time_s[v - 1]) continue;
    most = apart;
    const double first = std::max(kLeast_px2, mean + before / n);
    const double second = std::max(kLeast_px2, mean - before / (all - n));
    const bool later = second > first;
    best = Turning{0.5 * (time_s[v - 1] + time_s[v]), later ? second / first : first / second, later,
                   later ? 1.0 - n / all : n / all};
  }
  return best;
}

std::optional<ErrorModel> slipped_start(MeasurementSource& source, ModelFitter& fitter, const ErrorModel& offsets) {
  constexpr double kWidest_px = 40.0;
  auto alone = offsets;
  double least_px = kBetter * fitter.approach(alone, {}, kWidest_px);
  fitter.look_closely();
  const auto turn = turning(source, linearise(source, alone));
  if (!turn) return std::nullopt;
  std::optional<ErrorModel> best;
  for (const auto& target : effect_targets("slip", source.roles())) {
    auto model = alone;
    model.add("slip", target).parameters()[1].value = turn->time_s;
    begin_at_best_step(source, model);
    const double left_px = fitter.approach(model, {}, kWidest_px);
    if (left_px >= least_px || !plausible(model)) continue;
    least_px = left_px;
    best = std::move(model);
  }
  fitter.look_closely();
  if (best) {
    const std::size_t slip = best->size() - 1;
    (*best)[slip].parameters()[1].value = switching_time_s(source, *best, slip);
  }
  return best;
}

bool retime_slips(MeasurementSource& source, ErrorModel& model) {
  constexpr double kCell_s = 0.6, kWorth = 0.98;  // of the misfit
  bool moved = false;
  for (std::size_t e = 0; e < model.size(); ++e) {
    if (model[e].name() != "slip") continue;
    auto other = model;
    const double time_s = switching_time_s(source, model, e);
    other[e].parameters()[1].value = time_s;
    if (std::abs(time_s - model[e].parameters()[1].value) <= kCell_s) continue;
    const auto at = linearise(source, model);
    const double outline = outline_points(at);
    if (misfit(linearise(source, other), outline) > kWorth * misfit(at, outline)) continue;
    model = std::move(other);
    moved = true;
  }
  return moved;
}

bool plausible(const ErrorModel& model) {
  for (std::size_t e = 0; e < model.size(); ++e) {
    if (!plausible(model[e])) return false;
  }
  return true;
}

bool plausible(const Effect& effect) {
  static constexpr double kLargest = 20.0;  // typical sizes
  const auto& parameters = effect.parameters();
  return effect.name() == "joint_offset" ||
         std::none_of(parameters.begin(), parameters.end(),
                      [](const EffectParameter& p) { return p.fitted && std::abs(p.value) > kLargest * p.typical; });
}

std::optional<ErrorModel> nearer_model(MeasurementSource& source, const CoordinateLayout& layout, ModelFitter& fitter,
                                       const ErrorModel& offsets, const std::vector<CauseName>& causes) {
  return NearerModel(source, layout, fitter, causes).from(offsets);
}

}  // namespace bodyschema::diagnosis
