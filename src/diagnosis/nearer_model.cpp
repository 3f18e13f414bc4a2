#include "nearer_model.hpp"

#include <algorithm>
#include <cmath>
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
