#include "bodyschema/diagnosis/diagnoser.hpp"

#include <algorithm>
#include <optional>
#include <sstream>
#include <utility>

#include "bodyschema/core/error.hpp"
#include "bodyschema/diagnosis/detectable.hpp"
#include "bodyschema/effects/catalogue.hpp"
#include "candidates.hpp"
#include "extension.hpp"
#include "findings.hpp"
#include "model_fit.hpp"
#include "nearer_model.hpp"
#include "verdict.hpp"

namespace bodyschema {
namespace {

using namespace diagnosis;

class Diagnoser {
 public:
  Diagnoser(MeasurementSource& source, const DiagnosisOptions& options)
      : source_(source), options_(options), layout_(source.roles()), fitter_(source, layout_, options.block_s) {}

  DiagnosisReport run() {
    refuse_unusable();
    fit_baseline();
    auto found = search(before_.at, baseline_);
    // Where counterparts were looked for about a model far from the truth, once more from where the
    // first answer leads.
    std::optional<std::pair<Linearisation, ErrorModel>> nearer;
    if (far_off(found)) {
      nearer.emplace(std::move(found.after.at), found.extended);
      found = search(nearer->first, nearer->second);
    }
    look_for_far_slip(found, nearer);
    // Blocks were as long as the noise in rests of the arm seemed to ask for. A slip or a drift that
    // falls into a rest looks like slow noise until it is known; then shorter blocks show more.
    const auto shorter = plan_blocks(source_, found.after.at.views, options_.block_s);
    if (shorter.length_s < kWorthwhile * fitter_.plan().length_s) {
      fitter_.set_plan(shorter);
      fitter_.accumulate_on({}, before_);
      found = nearer ? search(nearer->first, nearer->second) : search(before_.at, baseline_);
    }
    if (searches() && (found.after.at.rms_px() > options_.noise_rms_px || much_at_once(found))) look_nearer(found);
    leave_out_causes(found);
    auto report = findings(source_, options_.selection, layout_, fitter_.plan(), found, baseline_, before_, excluded_,
                           options_.systematic_share, options_.systematic_error);
    word_verdict(report, options_);
    progress(1.0);
    return report;
  }

 private:
  static constexpr double kWorthwhile = 0.8;
  static constexpr double kFar_px = 1.0;  ///< Huber's cost counts every pixel beyond it less
  static constexpr double kBetter = 0.8;

  void fit_baseline() {
    baseline_ = baseline_model();
    fit_offsets();
    offsets_alone_ = baseline_;
    before_ = fitter_.fit(baseline_, {}, {options_.baseline_iterations, between(0.1, 0.5)});
    if (2 * seen(before_.at) < before_.at.views.size()) {
      // Parts of another shape: their outlines lie further off, however well they are placed.
      constexpr double kOtherShape_px = 10.0;
      other_shape_ = true;
      fitter_.set_finest(kOtherShape_px);
      baseline_ = offsets_alone_;
      before_ = fitter_.fit(baseline_, {}, {options_.baseline_iterations, {}});
    }
    check_seen(before_.at);
    // Once, on the residuals of the fitted baseline.
    fitter_.set_plan(plan_blocks(source_, before_.at.views, options_.block_s));
    fitter_.accumulate_on({}, before_);
    excluded_ = untestable(source_, before_.at);
    drop_untestable_nuisances();
  }

  /// A nuisance that this log says nothing about (vergence, of one camera) would end anywhere, unseen.
  void drop_untestable_nuisances() {
    const auto effects = baseline_.size();
    for (const auto& nuisance : options_.nuisances) {
      if (is_excluded(excluded_, nuisance)) baseline_.remove(nuisance.name, {nuisance.joint, nuisance.source});
    }
    if (baseline_.size() == effects) return;
    before_ = fitter_.fit(baseline_, {}, {.iterations = options_.refit_iterations, .from_afar = false});
    fitter_.set_plan(plan_blocks(source_, before_.at.views, options_.block_s));
    fitter_.accumulate_on({}, before_);
  }

  /// What a cause is worth shows against a model without it: nuisances that are causes go back to zero.
  void leave_out_causes(const Found& found) {
    bool changed = false;
    for (const auto& cause : found.selection.causes) {
      auto ids = cause.same;
      ids.insert(ids.end(), cause.replaced.begin(), cause.replaced.end());
      ids.push_back(cause.candidate);
      for (const auto c : ids) {
        const auto& candidate = found.set.candidates[c];
        if (!candidate.nuisance) continue;
        baseline_.remove(candidate.name, candidate.target);
        changed = true;
      }
    }
    for (const auto& cause : options_.fixed_causes.value_or(std::vector<CauseName>{})) {
      const EffectTarget target{cause.joint, cause.source};
      if (!contains(options_.nuisances, cause) || baseline_.find(cause.name, target) == nullptr) continue;
      baseline_.remove(cause.name, target);
      changed = true;
    }
    if (changed) before_ = fitter_.fit(baseline_, {}, {.iterations = options_.refit_iterations, .from_afar = false});
  }

  /// Where much of the outline stays out of sight: the search once more from a slip that brings it near. Half of it out
  /// of sight looks like parts of another shape, too.
  void look_for_far_slip(Found& found, std::optional<std::pair<Linearisation, ErrorModel>>& nearer) {
    constexpr double kUsuallyFound = 0.85, kUnlike = 6.0;
    if (!searches()) return;
    const auto turn = turning(source_, found.after.at);
    if (found.after.at.rms_px() <= options_.noise_rms_px && outline_found(found.after.at) >= kUsuallyFound &&
        !(turn && turn->unlike >= kUnlike) && !other_shape_) {
      return;
    }
    const double finest_px = fitter_.finest();
    fitter_.set_finest(ModelFitter::kFinest_px);
    if (auto start = slipped_start(source_, fitter_, offsets_)) {
      // Nuisances beside it from the beginning: their estimates are of use only with the offsets that belong to them.
      for (std::size_t e = 0; e < baseline_.size(); ++e) {
        const auto& effect = std::as_const(baseline_)[e];
        if (effect.name() != "joint_offset") start->add(effect.name(), effect.target());
      }
      auto at = fitter_.fit(*start, {}, {.iterations = options_.refit_iterations, .from_afar = false}).at;
      auto again = search(at, *start);
      const double outline = outline_points(before_.at);
      if (plausible(again.extended) && misfit(again.after.at, outline) < kBetter * misfit(found.after.at, outline)) {
        found = std::move(again);
        nearer.emplace(std::move(at), std::move(*start));
        if (other_shape_) before_ = fitter_.about(baseline_, {});
        other_shape_ = false;
        return;
      }
    }
    fitter_.set_finest(finest_px);
    fitter_.look_closely();
  }

  /// Much is wrong at once: causes that were tried for real, if they are plausible and leave less.
  void look_nearer(Found& found) {
    if (other_shape_) return;
    fitter_.look_closely();
    // While the head stands still a shifted base stands for whatever lies between base and eyes.
    const auto excluded = excluded_;
    std::erase_if(excluded_, [](const auto& item) { return item.cause.name == "base_shift"; });
    auto again = found_nearer();
    const double outline = outline_points(before_.at);
    // What no robot can be gives way to anything plausible that is better than offsets alone.
    const auto& to_beat = plausible(found.extended) ? found.after.at : before_.at;
    if (again && plausible(again->extended) && misfit(again->after.at, outline) < misfit(to_beat, outline)) {
      found = std::move(*again);
    } else {
      excluded_ = excluded;
    }
  }

  std::optional<Found> found_nearer() {
    std::vector<CauseName> causes;
    for (const auto& name : effect_names()) {
      if (name == "joint_offset" || name == "slip" || name == "drift") continue;  // need a time
      for (const auto& target : effect_targets(name, source_.roles())) {
        const CauseName cause{name, target.joint, target.source};
        // Nuisances are fitted in any case, once the outlines are near.
        if (!is_excluded(excluded_, cause) && !contains(options_.nuisances, cause)) causes.push_back(cause);
      }
    }
    const auto model = nearer_model(source_, layout_, fitter_, offsets_, causes);
    fitter_.look_closely();
    if (!model) return std::nullopt;
    // What lies between base and eyes is the shift's now; else the head's nuisances share it at will.
    auto nuisances = options_.nuisances;
    const auto found_causes = causes_of(*model);
    if (contains(found_causes, {"base_shift", "", ""})) {
      std::erase_if(nuisances, [](const auto& nuisance) { return nuisance.name == "head_offset"; });
    }
    return search(fitter_.about(*model, {}).at, *model, nuisances, found_causes);
  }

  static bool contains(const std::vector<CauseName>& causes, const CauseName& cause) {
    return std::find(causes.begin(), causes.end(), cause) != causes.end();
  }

  [[nodiscard]] ErrorModel offsets_at(const std::map<std::string, double>& start) const {
    ErrorModel offsets(source_.roles());
    for (const auto& target : effect_targets("joint_offset", source_.roles())) {
      const auto given = start.find(target.joint);
      offsets.add("joint_offset", target).parameters()[0].value = given == start.end() ? 0.0 : given->second;
    }
    return offsets;
  }

  static std::vector<CauseName> causes_of(const ErrorModel& model) {
    std::vector<CauseName> causes;
    for (std::size_t e = 0; e < model.size(); ++e) {
      if (model[e].name() == "joint_offset") continue;
      causes.push_back({model[e].name(), model[e].target().joint, model[e].target().source});
    }
    return causes;
  }

  /// Offsets alone before all else: nuisances let loose on outlines tens of pixels away run off.
  void fit_offsets() {
    constexpr double kStuck_px = 1.5, kWidest_px = 40.0;
    const auto from = [&](ErrorModel offsets) {
      const double left_px = fitter_.approach(offsets, {}, kWidest_px);
      return std::pair{left_px, std::move(offsets)};
    };
    auto best = from(offsets_at(options_.start_offsets));
    const auto try_from = [&](ErrorModel start) {
      if (best.first <= kStuck_px) return;
      auto other = from(std::move(start));
      if (other.first < best.first) best = std::move(other);
    };
    if (!options_.start_offsets.empty()) try_from(offsets_at({}));
    if (best.first > kStuck_px) {
      for (auto& start : scattered_starts(source_, best.second)) try_from(std::move(start));
    }
    offsets_ = best.second;
    for (std::size_t e = 0; e < best.second.size(); ++e) {
      const auto& offset = std::as_const(best.second)[e];
      baseline_.find("joint_offset", offset.target())->parameters()[0].value = offset.parameters()[0].value;
    }
    progress(0.1);
  }

  /// One pass over the catalogue, linear about `at`, the linearisation of `model`.
  Found search(const Linearisation& at, const ErrorModel& model) {
    return search(at, model, options_.nuisances, options_.fixed_causes.value_or(std::vector<CauseName>{}));
  }
  /// @param given  causes to begin with
  Found search(const Linearisation& at, const ErrorModel& model, const std::vector<CauseName>& nuisances,
               const std::vector<CauseName>& given) {
    const auto& plan = fitter_.plan();
    Found found{make_candidates(source_, at, plan, layout_, nuisances, excluded_), {}, baseline_, {}};
    auto& set = found.set;
    set_sizes(set);
    const auto bare = only_offsets(source_, layout_, at, model);
    const auto statistics = accumulate(bare, plan, set.pointers(), set.offsets.size());
    progress(0.6);
    drop_aliased_columns(statistics, set);
    auto rules = options_.selection;
    rules.search = searches();
    rules.one_pass = passes_once(source_);
    rules.given = candidates_of(set, given);
    found.selection = select_causes(statistics, set.offsets, set.candidates, rules);
    progress(0.65);

    auto extension =
        extend(baseline_with(nuisances, model), found.selection, {source_, layout_, plan, at, bare, set, statistics});
    found.extended = std::move(extension.model);
    begin_where_better(model, found.extended);
    found.after = fitter_.fit(found.extended, extension.generic, {options_.refit_iterations, between(0.65, 0.9)});
    fitter_.look_closely();
    if (rules.search && retime_slips(source_, found.extended)) {
      found.after = fitter_.fit(found.extended, extension.generic, {options_.refit_iterations, {}});
    }
    // What looked like a cause only because others were taken for linear is none.
    while (rules.search && drop_weakest(found.selection, set, found.after, rules, found.extended)) {
      found.after = fitter_.fit(found.extended, extension.generic, {options_.refit_iterations, {}});
    }
    return found;
  }

  /// The baseline's effects of these nuisances and the offsets of `model`.
  [[nodiscard]] ErrorModel baseline_with(const std::vector<CauseName>& nuisances, ErrorModel model) const {
    auto result = baseline_;
    for (const auto& nuisance : options_.nuisances) {
      if (!contains(nuisances, nuisance)) result.remove(nuisance.name, {nuisance.joint, nuisance.source});
    }
    for (const auto& target : effect_targets("joint_offset", source_.roles())) {
      auto* offset = model.find("joint_offset", target);
      if (offset == nullptr) continue;
      result.find("joint_offset", target)->parameters()[0].value = offset->parameters()[0].value;
    }
    return result;
  }

  /// A linear estimate that leads away from the outlines is taken back towards the model about which it is linear, and
  /// all the way where they are lost from sight: no fit comes back from there.
  void begin_where_better(const ErrorModel& about, ErrorModel& extended) {
    constexpr int kHalvings = 3;
    auto without = extended, model = about;
    for (std::size_t e = 0; e < without.size(); ++e) {
      auto* known = model.find(without[e].name(), without[e].target());
      for (std::size_t p = 0; p < without[e].parameters().size(); ++p) {
        auto& parameter = without[e].parameters()[p];
        if (!parameter.fitted) continue;
        parameter.value = known != nullptr ? known->parameters()[p].value : 0.0;
      }
    }
    const double outline = outline_points(before_.at);
    const double least = misfit(before_.at, outline);
    for (int i = 0; i < kHalvings; ++i) {
      if (misfit(linearise(source_, extended), outline) <= least) return;
      go_half_way(without, extended);
    }
    if (2 * seen(linearise(source_, extended)) < seen(before_.at)) extended = std::move(without);
  }

  [[nodiscard]] bool far_off(const Found& found) const {
    const double outline = outline_points(before_.at);
    const double before = misfit(before_.at, outline), after = misfit(found.after.at, outline);
    return searches() && !found.selection.causes.empty() && far(before_.at) && after < kBetter * before;
  }
  /// Several large causes, and small ones beside them: they may share what one that was not tried takes away.
  [[nodiscard]] bool much_at_once(const Found& found) const {
    return found.selection.crowded && found.selection.causes.size() >= options_.selection.crowd;
  }
  [[nodiscard]] bool searches() const { return options_.selection.search && !options_.fixed_causes; }
  [[nodiscard]] static bool far(const Linearisation& at) {
    return typical_distance_px(misfit(at, outline_points(at))) > kFar_px;
  }

  /// Which sizes are worth naming, in units of the candidates' columns.
  void set_sizes(CandidateSet& set) const {
    for (auto& candidate : set.candidates) {
      if (candidate.generic()) continue;
      const auto effect = make_effect(candidate.name, candidate.target, source_.roles());
      const auto& p = std::as_const(*effect).parameters()[0];
      const double column_per_unit = p.si_per_unit / p.typical;
      candidate.detectable = detectable_size(candidate.name, candidate.target, source_.roles()) * column_per_unit;
      const auto at = options_.tolerances.find(candidate.name);
      if (!(candidate.nuisance || candidate.slip) || at == options_.tolerances.end()) continue;
      candidate.tolerance = at->second * column_per_unit;
    }
  }

  void progress(double share) const {
    if (options_.progress) options_.progress(share);
  }
  [[nodiscard]] std::function<void(double)> between(double from, double to) const {
    return [this, from, to](double share) { progress(from + (to - from) * share); };
  }

  void refuse_unusable() const {
    const auto views = source_.views();
    const char* advice =
        "; record 60 to 120 s of arm motion before both eyes, slow and fast, the "
        "same postures in both directions, with 15 s of rest";
    if (views.empty() || source_.stream().empty()) {
      throw DataError(std::string("the log holds no usable pictures with encoders") + advice);
    }
    const double span = seconds(views.back().joints.utime - views.front().joints.utime);
    if (span < options_.shortest_log_s) {
      std::ostringstream text;
      text << "the log is too short to be diagnosed: " << span << " s, expected at least " << options_.shortest_log_s
           << " s" << advice;
      throw DataError(text.str());
    }
    for (std::size_t v = 1; v < views.size(); ++v) {
      if (views[v].joints.utime < views[v - 1].joints.utime) {
        throw DataError("the log's pictures are not in order of time; record it again or sort it");
      }
    }
  }

  static std::size_t seen(const Linearisation& at) {
    return static_cast<std::size_t>(
        std::count_if(at.views.begin(), at.views.end(), [](const auto& view) { return view.weight > 0.0; }));
  }

  static double outline_found(const Linearisation& at) {
    double outline = 0.0, matched = 0.0;
    for (const auto& view : at.views) {
      outline += view.outline;
      matched += view.matched;
    }
    return outline > 0.0 ? matched / outline : 1.0;
  }

  static void check_seen(const Linearisation& at) {
    if (4 * seen(at) < at.views.size()) {
      throw DataError("the hand's outline was found in " + std::to_string(seen(at)) + " of " +
                      std::to_string(at.views.size()) +
                      " pictures; keep the hand in view of both eyes and check the masks");
    }
  }

  [[nodiscard]] ErrorModel baseline_model() const {
    ErrorModel model(source_.roles());
    for (const auto& target : effect_targets("joint_offset", source_.roles())) {
      model.add("joint_offset", target);
    }
    for (const auto& nuisance : options_.nuisances) {
      model.add(nuisance.name, {nuisance.joint, nuisance.source});
    }
    return model;
  }

  static std::vector<std::size_t> candidates_of(const CandidateSet& set, const std::vector<CauseName>& causes) {
    std::vector<std::size_t> ids;
    for (const auto& cause : causes) {
      for (std::size_t c = 0; c < set.candidates.size(); ++c) {
        if (!set.candidates[c].slip && name_of(set.candidates[c]) == cause) ids.push_back(c);
      }
    }
    return ids;
  }

  MeasurementSource& source_;
  const DiagnosisOptions& options_;
  CoordinateLayout layout_;
  ModelFitter fitter_;
  ErrorModel baseline_{JointRoles{}};
  ErrorModel offsets_{JointRoles{}};        ///< offsets and nothing else
  ErrorModel offsets_alone_{JointRoles{}};  ///< the baseline with its nuisances at zero
  bool other_shape_ = false;                ///< outlines lie far off however well the parts are placed
  ModelFit before_;                         ///< about the baseline
  std::vector<NotTestable> excluded_;
};

}  // namespace

std::string CauseName::text() const {
  std::string text = name;
  if (!joint.empty()) text += " of " + joint;
  if (!source.empty()) text += (joint.empty() ? " " : " with ") + source;
  return text;
}

std::vector<CauseName> usual_nuisances(const JointRoles& roles) {
  std::vector<CauseName> list = {{"mesh_scale", "", ""}, {"silhouette_bias", "", ""}, {"focal_length", "", ""}};
  if (!roles.fingers.empty()) list.push_back({"finger_posture", "", ""});
  if (roles.has_pans()) list.push_back({"vergence", "", ""});
  if (roles.neck.size() >= 4) {
    for (const std::size_t i : {std::size_t{1}, std::size_t{3}}) {
      list.push_back({"head_offset", roles.names[static_cast<std::size_t>(roles.neck[i])], ""});
    }
  }
  return list;
}

DiagnosisReport diagnose(MeasurementSource& source, const DiagnosisOptions& options) {
  return Diagnoser(source, options).run();
}

}  // namespace bodyschema
