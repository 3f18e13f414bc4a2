#include "extension.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <utility>

namespace bodyschema::diagnosis {
namespace {

constexpr double kDeg = kPi / 180.0;

bool contains(const std::vector<std::size_t>& list, std::size_t item) {
  return std::find(list.begin(), list.end(), item) != list.end();
}

/// The time beside the winning cell's beginning at which the step fits best; the other columns
/// keep their values.
/// @param slip  position of the step's column in `columns`
double find_slip_time(const Evidence& evidence, const BlockFit& fit, const Columns& columns, Eigen::Index slip,
                      const Candidate& candidate) {
  constexpr double kBeside_s = 0.6;
  const auto& plan = evidence.plan;
  const auto views = evidence.source.views();
  const auto& begin = candidate.columns.front();
  const double cell_s = plan.cell_start_s[begin.from_block][begin.from_cell];
  double best_time = cell_s - 1e-4;
  if (!fit.usable) return best_time;
  const auto add = [&](Eigen::Index c, std::size_t v, Eigen::VectorXd& x) {
    const auto i = static_cast<std::size_t>(columns[static_cast<std::size_t>(c)].index);
    for (const auto& e : evidence.set.columns[i].views[v]) {
      x[static_cast<Eigen::Index>(e.coordinate)] += static_cast<double>(e.value) * fit.estimate[c];
    }
  };
  // Loss that switching the step on at a view takes away there.
  const auto gain = [&](std::size_t v) {
    const auto& view = evidence.bare[v];
    if (view.weight <= 0.0) return 0.0;
    Eigen::VectorXd x = Eigen::VectorXd::Zero(evidence.layout.size()), step = x;
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

/// Whether a cause was named that explains a nuisance away, by itself or with others.
bool swapped_out(const Selection& selection, std::size_t nuisance) {
  return std::any_of(selection.causes.begin(), selection.causes.end(), [&](const SelectedCause& cause) {
    return cause.candidate != nuisance && (contains(cause.same, nuisance) || contains(cause.replaced, nuisance));
  });
}

/// Parameters that this log cannot tell from the offsets are not fitted.
void fit_what_shows(Effect& effect, const Candidate& candidate) {
  std::size_t next = 0;  // among the effect's fitted parameters
  for (auto& p : effect.parameters()) {
    if (!p.fitted) continue;
    p.fitted = contains(candidate.parameters, next++);
    p.value = 0.0;
  }
}

/// Nuisances that were left out for causes which are no longer there.
void put_back_nuisances(const Selection& selection, const CandidateSet& set, ErrorModel& model) {
  for (std::size_t c = 0; c < set.candidates.size(); ++c) {
    const auto& candidate = set.candidates[c];
    if (!candidate.nuisance || contains(selection.not_testable, c)) continue;
    if (model.find(candidate.name, candidate.target) != nullptr) continue;
    if (!swapped_out(selection, c)) fit_what_shows(model.add(candidate.name, candidate.target), candidate);
  }
}

/// Wald z of a cause's parameters once they are fitted; 0 of one that is no effect of the model.
double fitted_z(const Candidate& candidate, const ModelFit& after, const ErrorModel& model) {
  std::vector<Eigen::Index> columns;
  std::vector<double> values;
  for (std::size_t c = 0; c < after.parameters.size(); ++c) {
    const auto& ref = after.parameters[c];
    const auto& effect = model[ref.effect];
    if (effect.name() != candidate.name || !(effect.target() == candidate.target)) continue;
    const auto& p = effect.parameters()[ref.parameter];
    values.push_back(p.value / p.typical);
    columns.push_back(static_cast<Eigen::Index>(c));
  }
  const auto n = static_cast<Eigen::Index>(columns.size());
  if (n == 0) return 0.0;
  Eigen::MatrixXd V = after.fit.covariance(columns, columns);
  V += 1e-12 * V.trace() * Eigen::MatrixXd::Identity(n, n);
  const Eigen::Map<const Eigen::VectorXd> value(values.data(), n);
  return equivalent_z(value.dot(V.ldlt().solve(value)), n);
}

}  // namespace

Extension extend(ErrorModel model, const Selection& selection, const Evidence& evidence) {
  const auto& set = evidence.set;
  Extension result{std::move(model), {}};
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
    if (!contains(selection.model, c) || swapped_out(selection, c)) {
      result.model.remove(candidate.name, candidate.target);
    } else {
      put(c);
    }
  }
  for (const auto& cause : selection.causes) {
    const auto& candidate = set.candidates[cause.candidate];
    if (candidate.nuisance && result.model.find(candidate.name, candidate.target) != nullptr) continue;
    put(cause.candidate);
    if (!candidate.generic()) continue;
    for (const auto& column : candidate.columns) {
      result.generic.push_back(&set.columns[static_cast<std::size_t>(column.index)]);
    }
  }
  const auto fit = evidence.statistics.fit(columns);
  for (const auto& [c, first] : at) {
    const auto& candidate = set.candidates[c];
    if (candidate.generic()) continue;
    auto& effect = result.model.add(candidate.name, candidate.target);
    if (!candidate.slip) {
      fit_what_shows(effect, candidate);
      Eigen::Index column = first;
      for (auto& p : effect.parameters()) {
        if (p.fitted && fit.usable) p.value = fit.estimate[column++] * p.typical;
      }
    }
    if (candidate.name == "backlash") {
      effect.parameters()[0].value = std::max(effect.parameters()[0].value, 1e-5);
    }
    if (candidate.slip) {
      // The column is an offset (true - encoder is its negative), in degrees.
      if (fit.usable) effect.parameters()[0].value = -fit.estimate[first] * kDeg;
      effect.parameters()[1].value = find_slip_time(evidence, fit, columns, first, candidate);
    }
    if (candidate.name == "drift") {
      const auto [begin, end] = seen_span(evidence.source, evidence.at);
      effect.parameters()[1].value = begin;
      effect.parameters()[2].value = end - begin;
    }
  }
  return result;
}

bool drop_weakest(Selection& selection, const CandidateSet& set, const ModelFit& after, const SelectionOptions& rules,
                  ErrorModel& model) {
  if (!after.fit.usable) return false;
  double weakest = 1.0;  // of the z asked
  auto worst = selection.causes.end();
  for (auto cause = selection.causes.begin(); cause != selection.causes.end(); ++cause) {
    const auto& candidate = set.candidates[cause->candidate];
    if (candidate.generic()) continue;
    const double z = z_of_few(fitted_z(candidate, after, model), after.statistics->seen_blocks(), rules.usual_blocks);
    const double share = z / rules.z_asked(candidate, cause->gain_judged);
    if (share >= weakest) continue;
    weakest = share;
    worst = cause;
  }
  if (worst == selection.causes.end()) return false;
  const auto& candidate = set.candidates[worst->candidate];
  selection.causes.erase(worst);
  if (candidate.nuisance) return true;
  model.remove(candidate.name, candidate.target);
  put_back_nuisances(selection, set, model);
  return true;
}

std::vector<CompressedView> only_offsets(const MeasurementSource& source, const CoordinateLayout& layout,
                                         const Linearisation& at, const ErrorModel& model) {
  auto bare = model;
  for (std::size_t e = 0; e < bare.size(); ++e) {
    if (bare[e].name() == "joint_offset") continue;
    for (auto& p : bare[e].parameters()) {
      if (p.fitted) p.value = 0.0;
    }
  }
  // What a memory holds while its effect is zero does not matter.
  bare.forget();
  auto views = at.views;
  Corrections corrections(static_cast<Eigen::Index>(source.roles().names.size()));
  Eigen::VectorXd x(layout.size()), x_bare(layout.size());
  for (std::size_t v = 0; v < views.size(); ++v) {
    if (views[v].weight <= 0.0) continue;
    bare.corrections(at.instants[v], corrections);
    layout.read(corrections, x_bare);
    layout.read(at.corrections[v], x);
    x -= x_bare;
    const Eigen::VectorXd Ax = views[v].information * x;
    views[v].square += 2.0 * x.dot(views[v].vector) + x.dot(Ax);
    views[v].vector += Ax;
  }
  return views;
}

}  // namespace bodyschema::diagnosis
