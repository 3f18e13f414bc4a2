#include "bodyschema/diagnosis/diagnoser.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <optional>
#include <sstream>
#include <utility>

#include "bodyschema/core/error.hpp"
#include "bodyschema/effects/catalogue.hpp"
#include "candidates.hpp"
#include "regression.hpp"

namespace bodyschema {
namespace {

using namespace diagnosis;

constexpr double kDeg = kPi / 180.0;

CauseName name_of(const Effect& effect) {
  return {effect.name(), effect.target().joint, effect.target().source};
}

CauseName name_of(const Candidate& candidate) {
  return {candidate.name, candidate.target.joint, candidate.target.source};
}

/// Two-sided 95 % point of Student's t.
double student95(double dof) {
  const double n = std::max(1.0, dof);
  return 1.96 + 2.37 / n + 2.8 / (n * n) + (n < 3.0 ? 5.0 / (n * n * n) : 0.0);
}

/// Which fitted parameter each column of an error model's regression is.
struct ParameterRef {
  std::size_t effect;
  std::size_t parameter;
};

std::vector<ParameterRef> fitted_parameters(const ErrorModel& model) {
  std::vector<ParameterRef> list;
  for (std::size_t e = 0; e < model.size(); ++e) {
    for (std::size_t p = 0; p < model[e].parameters().size(); ++p) {
      if (model[e].parameters()[p].fitted) list.push_back({e, p});
    }
  }
  return list;
}

/// A model's regression about itself: columns are its fitted parameters in units of `typical`,
/// then `extra` ones.
struct ModelFit {
  Linearisation at;
  std::vector<SparseColumn> columns;
  std::vector<ParameterRef> parameters;
  std::optional<BlockStatistics> statistics;
  Columns all;
  BlockFit fit;
};

class Diagnoser {
 public:
  Diagnoser(MeasurementSource& source, const DiagnosisOptions& options)
      : source_(source), options_(options), layout_(source.roles()) {}

  DiagnosisReport run() {
    refuse_unusable();
    const auto baseline = fit_baseline();
    auto found = search(baseline);
    // Blocks were as long as the noise in rests of the arm seemed to ask for. A slip or a drift that
    // falls into a rest looks like slow noise until it is known; then shorter blocks show more.
    const auto shorter = plan_blocks(source_, found.after.at.views, options_.block_s);
    if (shorter.length_s < kWorthwhile * plan_->length_s) {
      plan_ = shorter;
      accumulate_on({}, before_);
      found = search(baseline);
    }
    DiagnosisReport report;
    fill_report(report, found.set, found.selection, before_, found.after, baseline, found.extended,
                excluded_);
    progress(1.0);
    return report;
  }

 private:
  static constexpr double kWorthwhile = 0.8;

  /// One pass over the catalogue and the model it leads to.
  struct Search {
    CandidateSet set;
    Selection selection;
    ErrorModel extended;
    ModelFit after;
  };

  ErrorModel fit_baseline() {
    auto baseline = baseline_model();
    before_ = fit_nonlinear(baseline, {}, options_.baseline_iterations, 0.05, 0.5);
    check_seen(before_.at);
    excluded_ = options_.excluded;
    for (auto& item : untestable(source_, before_.at)) excluded_.push_back(std::move(item));
    // The candidates' own nuisances are counted from zero: move the linearisation there.
    zero_views_ = without_nuisances(before_.at, baseline);
    return baseline;
  }

  Search search(const ErrorModel& baseline) {
    const auto& plan = *plan_;
    Search found{make_candidates(source_, before_.at, plan, layout_, options_.nuisances, excluded_),
                 {}, baseline, {}};
    auto& set = found.set;
    set_tolerances(set);
    const auto statistics =
        accumulate(zero_views_, plan, set.pointers(), set.offsets.size());
    progress(0.6);
    drop_aliased_columns(statistics, set);
    auto rules = options_.selection;
    if (options_.fixed_causes) rules = fix(set, *options_.fixed_causes, std::move(rules));
    found.selection = select_causes(statistics, set.offsets, set.candidates, rules);
    progress(0.65);

    std::vector<const SparseColumn*> generic;
    add_causes(found.selection, set, statistics, found.extended, generic);
    found.after = fit_nonlinear(found.extended, generic, options_.refit_iterations, 0.65, 0.9);
    // What looked like a cause only because others were taken for linear is none.
    while (rules.search && drop_weakest(found.selection, set, found.after, found.extended)) {
      found.after = fit_nonlinear(found.extended, generic, options_.refit_iterations, 0.9, 0.95);
    }
    return found;
  }

  void set_tolerances(CandidateSet& set) const {
    for (auto& candidate : set.candidates) {
      const auto at = options_.tolerances.find(candidate.name);
      if (!candidate.nuisance || at == options_.tolerances.end()) continue;
      const auto effect = make_effect(candidate.name, candidate.target, source_.roles());
      const auto& p = std::as_const(*effect).parameters()[0];
      candidate.tolerance = at->second * p.si_per_unit / p.typical;
    }
  }

  void progress(double share) const {
    if (options_.progress) options_.progress(share);
  }

  void refuse_unusable() const {
    const auto views = source_.views();
    const char* advice = "; record 60 to 120 s of arm motion before both eyes, slow and fast, the "
                         "same postures in both directions, with 15 s of rest";
    if (views.empty() || source_.stream().empty()) {
      throw DataError(std::string("the log holds no usable pictures with encoders") + advice);
    }
    const double span = seconds(views.back().joints.utime - views.front().joints.utime);
    if (span < options_.shortest_log_s) {
      std::ostringstream text;
      text << "the log is too short to be diagnosed: " << span << " s, expected at least "
           << options_.shortest_log_s << " s" << advice;
      throw DataError(text.str());
    }
    for (std::size_t v = 1; v < views.size(); ++v) {
      if (views[v].joints.utime < views[v - 1].joints.utime) {
        throw DataError("the log's pictures are not in order of time; record it again or sort it");
      }
    }
  }

  void check_seen(const Linearisation& at) const {
    std::size_t seen = 0;
    for (const auto& view : at.views) seen += view.weight > 0.0;
    if (4 * seen < at.views.size()) {
      throw DataError("the hand's outline was found in " + std::to_string(seen) + " of " +
                      std::to_string(at.views.size()) +
                      " pictures; keep the hand in view of both eyes and check the masks");
    }
  }

  [[nodiscard]] ErrorModel baseline_model() const {
    ErrorModel model(source_.roles());
    for (const auto& target : effect_targets("joint_offset", source_.roles())) {
      auto& offset = model.add("joint_offset", target);
      const auto start = options_.start_offsets.find(target.joint);
      if (start != options_.start_offsets.end()) offset.parameters()[0].value = start->second;
    }
    for (const auto& nuisance : options_.nuisances) {
      model.add(nuisance.name, {nuisance.joint, nuisance.source});
    }
    return model;
  }

  [[nodiscard]] ModelFit regress(const ErrorModel& model,
                                 const std::vector<const SparseColumn*>& extra) {
    ModelFit result;
    result.at = linearise(source_, model);
    if (!plan_) plan_ = plan_blocks(source_, result.at.views, options_.block_s);
    result.parameters = fitted_parameters(model);
    std::vector<std::unique_ptr<Effect>> effects;
    for (std::size_t e = 0; e < model.size(); ++e) effects.push_back(model[e].clone());
    result.columns = effect_columns(source_, result.at, effects, layout_);
    accumulate_on(extra, result);
    return result;
  }

  /// Gauss-Newton over the model's fitted parameters; `model` ends at the optimum. Parameters that
  /// the log cannot see stay where they are.
  ModelFit fit_nonlinear(ErrorModel& model, const std::vector<const SparseColumn*>& extra,
                         int iterations, double progress_from, double progress_to) {
    const int least = options_.before_iteration && !planned_ ? 3 : 0;  // let the search narrow
    constexpr double kSmall = 2e-3;  // of the parameter's typical size
    constexpr double kLost = 0.7;    // of the outline seen so far
    constexpr int kMostRetreats = 6;
    auto accepted = model;
    double most_seen = 0.0;
    for (int i = 0, retreats = 0;; ++i) {
      if (options_.before_iteration) options_.before_iteration(planned_ ? 1000 : i);
      auto current = regress(model, extra);
      // A step too far loses the outline: half of it.
      if (seen_weight(current.at) < kLost * most_seen && retreats < kMostRetreats) {
        ++retreats;
        go_half_way(accepted, model);
        continue;
      }
      most_seen = std::max(most_seen, seen_weight(current.at));
      accepted = model;
      progress(progress_from + (progress_to - progress_from) * (i + 1) / (iterations + 1));
      const auto step = damped_step(current);
      if (i >= iterations || (i >= least && step.cwiseAbs().maxCoeff() < kSmall)) {
        if (!planned_) {
          // Once, on the residuals of the fitted baseline.
          plan_ = plan_blocks(source_, current.at.views, options_.block_s);
          planned_ = true;
          accumulate_on(extra, current);
        }
        return current;
      }
      for (std::size_t c = 0; c < current.parameters.size(); ++c) {
        const auto& ref = current.parameters[c];
        auto& parameter = model[ref.effect].parameters()[ref.parameter];
        parameter.value += step[static_cast<Eigen::Index>(c)] * parameter.typical;
        if (model[ref.effect].name() == "backlash") parameter.value = std::max(parameter.value, 1e-5);
      }
    }
  }

  static double seen_weight(const Linearisation& at) {
    double weight = 0.0;
    for (const auto& view : at.views) weight += view.weight;
    return weight;
  }

  /// `model` back to the middle between itself and `accepted`.
  static void go_half_way(const ErrorModel& accepted, ErrorModel& model) {
    for (std::size_t e = 0; e < model.size(); ++e) {
      for (std::size_t p = 0; p < model[e].parameters().size(); ++p) {
        auto& value = model[e].parameters()[p].value;
        value = 0.5 * (value + accepted[e].parameters()[p].value);
      }
    }
  }

  void accumulate_on(const std::vector<const SparseColumn*>& extra, ModelFit& current) const {
    std::vector<const SparseColumn*> pointers;
    for (const auto& column : current.columns) pointers.push_back(&column);
    pointers.insert(pointers.end(), extra.begin(), extra.end());
    current.all.clear();
    for (Eigen::Index c = 0; c < static_cast<Eigen::Index>(pointers.size()); ++c) {
      current.all.push_back({c, 0});
    }
    current.statistics.emplace(accumulate(current.at.views, *plan_, pointers));
    current.fit = current.statistics->fit(current.all);
  }

  /// Gauss-Newton step, with a faint pull to zero so that directions nobody sees stay put.
  [[nodiscard]] static Eigen::VectorXd damped_step(const ModelFit& at) {
    const auto n = static_cast<Eigen::Index>(at.all.size());
    Eigen::MatrixXd H = Eigen::MatrixXd::Zero(n, n);
    Eigen::VectorXd g = Eigen::VectorXd::Zero(n);
    for (const auto& block : at.statistics->blocks()) {
      H += block.information;
      g += block.vector;
    }
    H.diagonal().array() += 1e-6 * std::max(1e-9, H.diagonal().maxCoeff());
    return H.ldlt().solve(g);
  }

  /// The views as if nuisances were zero, by linearity.
  [[nodiscard]] std::vector<CompressedView> without_nuisances(const Linearisation& at,
                                                              const ErrorModel& model) const {
    auto bare = model;
    for (std::size_t e = 0; e < bare.size(); ++e) {
      if (bare[e].name() == "joint_offset") continue;
      for (auto& p : bare[e].parameters()) {
        if (p.fitted) p.value = 0.0;
      }
    }
    auto views = at.views;
    Corrections corrections(static_cast<Eigen::Index>(source_.roles().names.size()));
    Eigen::VectorXd x(layout_.size()), x_bare(layout_.size());
    for (std::size_t v = 0; v < views.size(); ++v) {
      if (views[v].weight <= 0.0) continue;
      bare.corrections(at.instants[v], corrections);
      layout_.read(corrections, x_bare);
      layout_.read(at.corrections[v], x);
      x -= x_bare;
      const Eigen::VectorXd Ax = views[v].information * x;
      views[v].square += 2.0 * x.dot(views[v].vector) + x.dot(Ax);
      views[v].vector += Ax;
    }
    return views;
  }

  /// The given causes; of a slip, the time that fits best.
  static SelectionOptions fix(const CandidateSet& set, const std::vector<CauseName>& causes,
                              SelectionOptions rules) {
    rules.search = false;
    for (const auto& cause : causes) {
      for (std::size_t c = 0; c < set.candidates.size(); ++c) {
        if (set.candidates[c].slip || name_of(set.candidates[c]) != cause) continue;
        rules.fixed.push_back(c);
      }
    }
    return rules;
  }

  void add_causes(const Selection& selection, const CandidateSet& set,
                  const BlockStatistics& statistics, ErrorModel& model,
                  std::vector<const SparseColumn*>& generic) {
    Columns columns = set.offsets;
    std::vector<std::pair<std::size_t, Eigen::Index>> at;  // candidate, first column
    const auto put = [&](std::size_t c) {
      at.emplace_back(c, static_cast<Eigen::Index>(columns.size()));
      const auto& list = set.candidates[c].columns;
      columns.insert(columns.end(), list.begin(), list.end());
    };
    // A nuisance that a cause explains away is left out again.
    for (std::size_t c = 0; c < set.candidates.size(); ++c) {
      const auto& candidate = set.candidates[c];
      if (!candidate.nuisance) continue;
      const bool kept = std::find(selection.model.begin(), selection.model.end(), c) !=
                        selection.model.end();
      const bool swapped_out = std::any_of(
          selection.causes.begin(), selection.causes.end(), [&](const SelectedCause& cause) {
            return cause.candidate != c &&
                   std::find(cause.same.begin(), cause.same.end(), c) != cause.same.end();
          });
      if (!kept || swapped_out) {
        model.remove(candidate.name, candidate.target);
      } else {
        put(c);
      }
    }
    for (const auto& cause : selection.causes) {
      const auto& candidate = set.candidates[cause.candidate];
      if (candidate.nuisance && model.find(candidate.name, candidate.target) != nullptr) continue;
      put(cause.candidate);
      if (candidate.generic()) {
        for (const auto& column : candidate.columns) {
          generic.push_back(&set.columns[static_cast<std::size_t>(column.index)]);
        }
      }
    }
    const auto fit = statistics.fit(columns);
    for (const auto& [c, first] : at) {
      const auto& candidate = set.candidates[c];
      if (candidate.generic()) continue;
      auto& effect = model.add(candidate.name, candidate.target);
      if (!candidate.slip) {
        std::size_t next = 0;  // among the effect's fitted parameters
        Eigen::Index column = 0;
        for (auto& p : effect.parameters()) {
          if (!p.fitted) continue;
          const auto& kept = candidate.parameters;
          const bool seen = std::find(kept.begin(), kept.end(), next++) != kept.end();
          p.fitted = seen;
          p.value = seen && fit.usable ? fit.estimate[first + column] * p.typical : 0.0;
          column += seen;
        }
      }
      if (candidate.name == "backlash") {
        effect.parameters()[0].value = std::max(effect.parameters()[0].value, 1e-5);
      }
      if (candidate.slip) {
        // The column is an offset (true - encoder is its negative), in degrees.
        if (fit.usable) effect.parameters()[0].value = -fit.estimate[first] * kDeg;
        effect.parameters()[1].value = find_slip_time(set, fit, columns, first, candidate);
      }
      if (candidate.name == "drift") {
        const auto [begin, end] = seen_span(source_, before_.at);
        effect.parameters()[1].value = begin;
        effect.parameters()[2].value = end - begin;
      }
    }
  }

  /// The time beside the winning cell's beginning at which the step fits best; the other columns
  /// keep their values.
  double find_slip_time(const CandidateSet& set, const BlockFit& fit, const Columns& columns,
                        Eigen::Index slip, const Candidate& candidate) {
    constexpr double kBeside_s = 0.6;
    const auto& plan = *plan_;
    const auto views = source_.views();
    const auto& begin = candidate.columns.front();
    const double cell_s = plan.cell_start_s[begin.from_block][begin.from_cell];
    double best_time = cell_s - 1e-4;
    if (!fit.usable) return best_time;
    const auto add = [&](Eigen::Index c, std::size_t v, Eigen::VectorXd& x) {
      const auto i = static_cast<std::size_t>(columns[static_cast<std::size_t>(c)].index);
      for (const auto& e : set.columns[i].views[v]) {
        x[static_cast<Eigen::Index>(e.coordinate)] += static_cast<double>(e.value) * fit.estimate[c];
      }
    };
    // Loss that switching the step on at a view takes away there.
    const auto gain = [&](std::size_t v) {
      const auto& view = zero_views_[v];
      if (view.weight <= 0.0) return 0.0;
      Eigen::VectorXd x = Eigen::VectorXd::Zero(layout_.size()), step = x;
      for (Eigen::Index c = 0; c < static_cast<Eigen::Index>(columns.size()); ++c) {
        const auto& column = columns[static_cast<std::size_t>(c)];
        if (c != slip && plan.reached(v, column.from_block, column.from_cell)) add(c, v, x);
      }
      add(slip, v, step);
      const Eigen::VectorXd rest = view.vector - view.information * x;
      return plan.weight_of_view[v] * (2.0 * step.dot(rest) - step.dot(view.information * step));
    };
    // Backwards: the sum of gains of all views after the switch.
    double running = 0.0, best = 0.0;
    for (std::size_t v = views.size(); v-- > 0;) {
      const double t = seconds(views[v].joints.utime);
      if (t > cell_s + kBeside_s) continue;
      if (t < cell_s - kBeside_s) break;
      running += gain(v);
      if (running > best) {
        best = running;
        best_time = t - 1e-4;
      }
    }
    return best_time;
  }

  /// Takes out the named cause with the smallest z if that no longer suffices; whether it did.
  bool drop_weakest(Selection& selection, const CandidateSet& set, const ModelFit& after,
                    ErrorModel& model) const {
    if (!after.fit.usable) return false;
    double weakest = options_.selection.z_enter;
    auto worst = selection.causes.end();
    for (auto cause = selection.causes.begin(); cause != selection.causes.end(); ++cause) {
      const auto& candidate = set.candidates[cause->candidate];
      if (candidate.generic()) continue;
      std::vector<Eigen::Index> columns;
      Eigen::VectorXd value(2);
      for (std::size_t c = 0; c < after.parameters.size(); ++c) {
        const auto& ref = after.parameters[c];
        if (name_of(model[ref.effect]) != name_of(candidate) || columns.size() == 2) continue;
        const auto& p = std::as_const(model)[ref.effect].parameters()[ref.parameter];
        value[static_cast<Eigen::Index>(columns.size())] = p.value / p.typical;
        columns.push_back(static_cast<Eigen::Index>(c));
      }
      const auto n = static_cast<Eigen::Index>(columns.size());
      if (n == 0) continue;
      Eigen::MatrixXd V(n, n);
      for (Eigen::Index i = 0; i < n; ++i) {
        for (Eigen::Index j = 0; j < n; ++j) {
          V(i, j) = after.fit.covariance(columns[static_cast<std::size_t>(i)],
                                         columns[static_cast<std::size_t>(j)]);
        }
      }
      V += 1e-12 * V.trace() * Eigen::MatrixXd::Identity(n, n);
      const double z = equivalent_z(value.head(n).dot(V.ldlt().solve(value.head(n))), n);
      if (z < weakest) {
        weakest = z;
        worst = cause;
      }
    }
    if (worst == selection.causes.end()) return false;
    const auto& candidate = set.candidates[worst->candidate];
    if (!candidate.nuisance) model.remove(candidate.name, candidate.target);
    selection.causes.erase(worst);
    return true;
  }

  // ---- the report ----

  [[nodiscard]] double inflation(const BlockFit& fit) const {
    if (!fit.usable) return 1.0;
    std::vector<double> dispersion;
    for (Eigen::Index i = 0; i < fit.estimate.size(); ++i) {
      dispersion.push_back(fit.covariance(i, i) / fit.model_variance[i]);
    }
    const auto middle = dispersion.begin() + static_cast<std::ptrdiff_t>(dispersion.size() / 2);
    std::nth_element(dispersion.begin(), middle, dispersion.end());
    return *middle;
  }

  [[nodiscard]] std::array<double, 2> interval(const ModelFit& fit, Eigen::Index column,
                                               double value, double typical) const {
    if (!fit.fit.usable) {
      const double inf = std::numeric_limits<double>::infinity();
      return {-inf, inf};
    }
    const double floor = 0.7 * inflation(fit.fit) * fit.fit.model_variance[column];
    const double sd = std::sqrt(std::max(fit.fit.covariance(column, column), floor)) * typical;
    const double half =
        student95(static_cast<double>(fit.statistics->block_count()) - 1.0) * sd;
    return {value - half, value + half};
  }

  void fill_report(DiagnosisReport& report, const CandidateSet& set, const Selection& selection,
                   const ModelFit& before, const ModelFit& after, const ErrorModel& baseline,
                   const ErrorModel& extended, const std::vector<NotTestable>& excluded) {
    const auto& roles = source_.roles();
    report.z_threshold = options_.selection.z_enter;
    report.gain_threshold = options_.selection.gain_floor;
    report.duration_s = seconds(source_.views().back().joints.utime -
                                source_.views().front().joints.utime);
    report.block_s = plan_->length_s;
    report.noise_correlation_s = plan_->correlation_s;
    report.views = source_.views().size();
    report.blocks = plan_->block_count();
    for (const auto joint : roles.arm) {
      report.arm_joints.push_back(roles.names[static_cast<std::size_t>(joint)]);
    }
    report.not_testable = excluded;
    add_uninformed(report, set, selection);

    for (const auto& selected : selection.causes) {
      const auto& candidate = set.candidates[selected.candidate];
      DiagnosedCause cause;
      cause.cause = name_of(candidate);
      cause.variable = candidate.variable;
      cause.z = selected.score.z;
      cause.heldout_gain = selected.score.gain;
      cause.same.push_back(cause.cause);
      for (const auto c : selected.same) cause.same.push_back(name_of(set.candidates[c]));
      if (selected.wanders) cause.same.push_back({"unexplained", cause.cause.joint, ""});
      if (cause.same.size() > 1) cause.advice = splitting_motion(cause.same);
      for (std::size_t c = 0; c < after.parameters.size(); ++c) {
        const auto& ref = after.parameters[c];
        if (name_of(extended[ref.effect]) != cause.cause) continue;
        const auto& p = extended[ref.effect].parameters()[ref.parameter];
        const auto ci = interval(after, static_cast<Eigen::Index>(c), p.value, p.typical);
        cause.parameters.push_back({p.name, p.unit, p.in_unit(),
                                    {ci[0] / p.si_per_unit, ci[1] / p.si_per_unit}});
      }
      const bool listed = std::any_of(report.causes.begin(), report.causes.end(), [&](const auto& c) {
        return c.cause == cause.cause && c.variable == cause.variable;
      });
      if (!listed) report.causes.push_back(std::move(cause));
    }
    add_limits(report, set, selection);
    report.rest_gain = selection.rest_gain;
    report.rest_t = selection.rest_t;

    for (std::size_t c = 0; c < set.candidates.size(); ++c) {
      const auto& first = selection.first_scores[c];
      const auto& last = selection.last_scores[c];
      const auto label = set.candidates[c].description();
      auto bar = std::find_if(report.bars.begin(), report.bars.end(),
                              [&](const auto& b) { return b.label == label; });
      if (bar == report.bars.end()) {
        report.bars.push_back({label, set.candidates[c].generic(), set.candidates[c].nuisance,
                               first.testable, 0.0, 0.0, 0.0, 0.0});
        bar = report.bars.end() - 1;
      }
      // Slips at other times and other shapes of a generic variable share a bar: the best counts.
      bar->z_before = std::max(bar->z_before, first.z);
      bar->gain_before = std::max(bar->gain_before, first.gain);
      bar->z_after = std::max(bar->z_after, last.z);
      bar->gain_after = std::max(bar->gain_after, last.gain);
    }

    for (const auto joint : roles.arm) {
      const auto& name = roles.names[static_cast<std::size_t>(joint)];
      report.offsets_deg_before[name] = degrees(baseline.offsets()[joint]);
      report.offsets_deg_after[name] = degrees(extended.offsets()[joint]);
    }
    for (std::size_t c = 0; c < after.parameters.size(); ++c) {
      const auto& ref = after.parameters[c];
      if (extended[ref.effect].name() != "joint_offset") continue;
      const auto& p = extended[ref.effect].parameters()[ref.parameter];
      const auto ci = interval(after, static_cast<Eigen::Index>(c), p.value, p.typical);
      report.offsets_ci95_deg[extended[ref.effect].target().joint] = {degrees(ci[0]), degrees(ci[1])};
    }
    report.before = heldout(before, report, true);
    report.after = heldout(after, report, false);
    report.joint_corrections_before = joint_corrections(before.at);
    report.joint_corrections_after = joint_corrections(after.at);
    report.baseline_model = baseline;
    report.extended_model = extended;
    word_verdict(report);
    if (plan_->correlation_s <= 0.0) {
      report.warnings.push_back("no rest of 3 s or more in the log: the noise's correlation time is "
                                "not measured, blocks are " + std::to_string(std::lround(plan_->length_s)) + " s");
    }
    if (selection.crowded) {
      std::string list;
      for (const auto& cause : selection.set_aside) {
        list += (list.empty() ? "" : ", ") + set.candidates[cause.candidate].description();
      }
      report.warnings.push_back("several small errors share what is left" +
                                (list.empty() ? "" : "; none stands out among " + list));
    }
    if (report.duration_s < 30.0) {
      report.warnings.push_back("the log is shorter than 30 s: small causes stay hidden");
    }
  }

  [[nodiscard]] Eigen::MatrixXd joint_corrections(const Linearisation& at) const {
    const auto& arm = source_.roles().arm;
    Eigen::MatrixXd result(static_cast<Eigen::Index>(at.corrections.size()),
                           static_cast<Eigen::Index>(arm.size()));
    for (Eigen::Index v = 0; v < result.rows(); ++v) {
      for (Eigen::Index j = 0; j < result.cols(); ++j) {
        result(v, j) =
            at.corrections[static_cast<std::size_t>(v)].dq[arm[static_cast<std::size_t>(j)]];
      }
    }
    return result;
  }

  void add_uninformed(DiagnosisReport& report, const CandidateSet& set,
                      const Selection& selection) const {
    for (const auto c : selection.not_testable) {
      const auto& candidate = set.candidates[c];
      if (candidate.generic() || candidate.slip) continue;
      const auto name = name_of(candidate);
      report.not_testable.push_back(
          {name, "in this log it looks exactly like the joint offsets or what is fitted already"});
    }
  }

  void add_limits(DiagnosisReport& report, const CandidateSet& set, const Selection& selection) const {
    for (const auto& limit : selection.limits) {
      const auto& candidate = set.candidates[limit.candidate];
      if (candidate.generic() || candidate.slip) continue;
      const auto effect = make_effect(candidate.name, candidate.target, source_.roles());
      std::size_t i = 0;
      std::size_t next = 0;
      for (const auto& p : std::as_const(*effect).parameters()) {
        if (!p.fitted) continue;
        const auto& kept = candidate.parameters;
        if (std::find(kept.begin(), kept.end(), next++) == kept.end()) continue;
        report.exclusion_limits.push_back({name_of(candidate), p.name, p.unit,
                                           limit.limit[i++] * p.typical / p.si_per_unit});
      }
    }
  }

  /// Held-out residuals, and the motion of the hand that they ask for.
  HeldoutError heldout(const ModelFit& fit, DiagnosisReport& report, bool before) {
    HeldoutError error;
    const auto& roles = source_.roles();
    const auto& plan = *plan_;
    const auto views = source_.views();
    const auto arm = static_cast<Eigen::Index>(roles.arm.size());
    double square = 0.0, weight = 0.0, mm2 = 0.0, deg2 = 0.0;
    std::size_t hands = 0;
    if (before) report.samples.resize(views.size());
    Eigen::MatrixXd A = Eigen::MatrixXd::Zero(arm, arm);
    Eigen::VectorXd b = Eigen::VectorXd::Zero(arm);
    Eigen::VectorXd x(layout_.size());
    for (std::size_t v = 0; v < views.size(); ++v) {
      const auto& view = fit.at.views[v];
      auto& sample = report.samples[v];
      if (before) {
        sample.time_s = seconds(views[v].joints.utime - views.front().joints.utime);
        sample.camera = views[v].camera;
        for (const auto joint : roles.arm) {
          sample.angle_deg.push_back(degrees(fit.at.instants[v].q[joint]));
          sample.velocity_deg_s.push_back(degrees(fit.at.instants[v].qdot[joint]));
          sample.torque_nm.push_back(fit.at.instants[v].gravity_torque.size() > 0
                                         ? fit.at.instants[v].gravity_torque[joint] : 0.0);
        }
      }
      auto& apparent = before ? sample.apparent_deg_before : sample.apparent_deg_after;
      apparent.assign(static_cast<std::size_t>(arm), 0.0);
      if (view.weight <= 0.0) continue;
      x.setZero();
      if (fit.fit.usable) {
        const auto replica = fit.fit.replicas.col(static_cast<Eigen::Index>(plan.block_of_view[v]));
        for (std::size_t c = 0; c < fit.columns.size(); ++c) {
          for (const auto& e : fit.columns[c].views[v]) {
            x[static_cast<Eigen::Index>(e.coordinate)] +=
                static_cast<double>(e.value) * replica[static_cast<Eigen::Index>(c)];
          }
        }
      }
      const Eigen::VectorXd rest = view.vector - view.information * x;
      const double loss = view.square - x.dot(view.vector) - x.dot(rest);
      square += plan.weight_of_view[v] * loss;
      weight += plan.weight_of_view[v] * view.weight;
      (before ? sample.rms_px_before : sample.rms_px_after) =
          std::sqrt(std::max(0.0, loss / view.weight));
      (before ? sample.mean_px_before : sample.mean_px_after) = rest[layout_.size() - 1] / view.weight;
      for (Eigen::Index j = 0; j < arm; ++j) {
        const double information = view.information(j, j);
        if (information > 0.0) {
          apparent[static_cast<std::size_t>(j)] = degrees(rest[j] / information);
        }
      }
      // Both eyes of one instant together: the correction of all arm joints, held by a weak prior.
      const bool same = v > 0 && views[v].joints.utime - views[v - 1].joints.utime < 50'000 &&
                        views[v].camera != views[v - 1].camera && views[v].camera > 0;
      if (!same) {
        A.setZero();
        b.setZero();
      }
      A += view.information.topLeftCorner(arm, arm);
      b += rest.head(arm);
      const bool last_of_instant = v + 1 == views.size() || views[v + 1].camera == 0 || same;
      if (!last_of_instant) continue;
      Eigen::MatrixXd regular = A;
      regular.diagonal().array() += 0.25 / (1.0 * kDeg * 1.0 * kDeg);  // (0.5 px)^2 against 1 deg
      const Eigen::VectorXd dq = regular.ldlt().solve(b);
      const auto& jacobian = jacobian_at(v, fit.at.corrections[v]);
      const Eigen::VectorXd motion = jacobian.leftCols(arm) * dq;
      mm2 += motion.head<3>().squaredNorm() * 1e6;
      deg2 += motion.tail<3>().squaredNorm() / (kDeg * kDeg);
      ++hands;
    }
    error.rms_px = weight > 0.0 ? std::sqrt(std::max(0.0, square / weight)) : 0.0;
    if (hands > 0) {
      error.hand_mm = std::sqrt(mm2 / static_cast<double>(hands));
      error.hand_deg = std::sqrt(deg2 / static_cast<double>(hands));
    }
    return error;
  }

  const Eigen::MatrixXd& jacobian_at(std::size_t view, const Corrections& corrections) {
    if (jacobians_.empty()) jacobians_.resize(source_.views().size());
    if (jacobians_[view].size() == 0) jacobians_[view] = source_.hand_jacobian(view, corrections);
    return jacobians_[view];
  }

  static void word_verdict(DiagnosisReport& report) {
    if (report.causes.empty()) {
      report.verdict = "none";
      report.sentence = "The model explains the log to its noise: nothing but joint offsets was found.";
      return;
    }
    bool unexplained = false, several = false;
    std::string list;
    for (const auto& cause : report.causes) {
      unexplained = unexplained || cause.cause.name == "unexplained";
      several = several || cause.same.size() > 1;
      if (!list.empty()) list += "; ";
      if (cause.cause.name == "unexplained") {
        list += "something that follows the " + cause.variable + " of " + cause.cause.joint +
                " and that no known cause explains";
        continue;
      }
      list += cause.cause.text();
      for (const auto& p : cause.parameters) {
        std::ostringstream value;
        value.precision(3);
        value << " " << p.parameter << " " << p.estimate << " " << (p.unit == "1" ? "" : p.unit) << " ["
              << p.ci95[0] << ", " << p.ci95[1] << "]";
        list += value.str();
      }
      if (cause.same.size() > 1) {
        list += " (or";
        for (std::size_t i = 1; i < cause.same.size(); ++i) {
          list += std::string(i > 1 ? "," : "") + " " + cause.same[i].text();
        }
        list += ", which this log cannot tell from it)";
      }
    }
    report.verdict = unexplained ? "unexplained" : several ? "class" : "named";
    report.sentence = "The log asks for: " + list + ".";
  }

  MeasurementSource& source_;
  const DiagnosisOptions& options_;
  CoordinateLayout layout_;
  std::optional<BlockPlan> plan_;
  bool planned_ = false;
  ModelFit before_;                     ///< about the baseline
  std::vector<NotTestable> excluded_;
  std::vector<CompressedView> zero_views_;
  std::vector<Eigen::MatrixXd> jacobians_;
};

}  // namespace

std::string CauseName::text() const {
  std::string text = name;
  if (!joint.empty()) text += " of " + joint;
  if (!source.empty()) text += (joint.empty() ? " " : " with ") + source;
  return text;
}

std::vector<CauseName> usual_nuisances(const JointRoles& roles) {
  std::vector<CauseName> list = {{"mesh_scale", "", ""}, {"silhouette_bias", "", ""},
                                 {"focal_length", "", ""}};
  if (!roles.fingers.empty()) list.push_back({"finger_posture", "", ""});
  if (roles.head.size() >= 6) list.push_back({"vergence", "", ""});
  if (roles.head.size() >= 4) {
    for (const std::size_t i : {std::size_t{1}, std::size_t{3}}) {
      list.push_back({"head_offset", roles.names[static_cast<std::size_t>(roles.head[i])], ""});
    }
  }
  return list;
}

DiagnosisReport diagnose(MeasurementSource& source, const DiagnosisOptions& options) {
  return Diagnoser(source, options).run();
}

}  // namespace bodyschema
