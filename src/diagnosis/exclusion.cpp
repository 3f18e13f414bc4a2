#include "exclusion.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "bodyschema/effects/catalogue.hpp"

namespace bodyschema::diagnosis {
namespace {

constexpr const char* kLooksAlike = "in this log it looks exactly like the joint offsets or what is fitted already";

/// The final model's regression with the columns of the whole catalogue beside it.
class BesideTheModel {
 public:
  BesideTheModel(MeasurementSource& source, const CoordinateLayout& layout, const BlockPlan& plan, const Found& found,
                 const std::vector<NotTestable>& not_testable)
      : set_(make_candidates(source, found.after.at, plan, layout, {}, not_testable)) {
    // Generic features come last and get no limits.
    std::erase_if(set_.candidates, [](const auto& candidate) { return candidate.generic(); });
    Eigen::Index used = static_cast<Eigen::Index>(set_.offsets.size());
    for (const auto& candidate : set_.candidates) {
      for (const auto& column : candidate.columns) used = std::max(used, column.index + 1);
    }
    auto pointers = set_.pointers();
    pointers.resize(static_cast<std::size_t>(used));
    Columns base = set_.offsets;
    const auto fit_too = [&](const SparseColumn& column) {
      base.push_back({static_cast<Eigen::Index>(pointers.size())});
      pointers.push_back(&column);
    };
    for (std::size_t c = 0; c < found.after.parameters.size(); ++c) {
      const auto& effect = found.extended[found.after.parameters[c].effect];
      if (effect.name() != "joint_offset") fit_too(found.after.columns[c]);
    }
    for (const auto& cause : found.selection.causes) {
      const auto& candidate = found.set.candidates[cause.candidate];
      if (!candidate.generic()) continue;
      for (const auto& column : candidate.columns) {
        fit_too(found.set.columns[static_cast<std::size_t>(column.index)]);
      }
    }
    statistics_.emplace(accumulate(found.after.at.views, plan, pointers, set_.offsets.size()));
    drop_aliased_columns(*statistics_, set_);
    first_ = static_cast<Eigen::Index>(base.size());
    fits_.emplace(*statistics_, base);
  }
  BesideTheModel(const BesideTheModel&) = delete;  // the fits hold a reference
  BesideTheModel& operator=(const BesideTheModel&) = delete;

  [[nodiscard]] const std::vector<Candidate>& candidates() const { return set_.candidates; }
  [[nodiscard]] bool usable() const { return fits_->base().usable; }
  [[nodiscard]] BlockFit with(const Candidate& candidate) const { return fits_->with(candidate.columns); }
  /// Position of a candidate's columns in its fit.
  [[nodiscard]] Eigen::Index first() const { return first_; }

 private:
  CandidateSet set_;
  std::optional<BlockStatistics> statistics_;
  std::optional<NestedFits> fits_;
  Eigen::Index first_ = 0;
};

bool is_held_possible(const DiagnosisReport& report, const CauseName& cause) {
  return std::any_of(report.causes.begin(), report.causes.end(), [&](const DiagnosedCause& named) {
    return std::find(named.same.begin(), named.same.end(), cause) != named.same.end();
  });
}

/// A candidate's limits in the units of its effect's parameters.
std::vector<ExclusionLimit> limits_of(const Candidate& candidate, const BlockFit& fit, Eigen::Index first,
                                      const IntervalRule& rule, const JointRoles& roles) {
  std::vector<ExclusionLimit> limits;
  const auto effect = make_effect(candidate.name, candidate.target, roles);
  std::size_t index = 0;
  for (const auto& p : std::as_const(*effect).parameters()) {
    if (!p.fitted) continue;
    const auto& kept = candidate.parameters;
    // A slip's column has no list: it is the step.
    if (!candidate.slip && std::find(kept.begin(), kept.end(), index++) == kept.end()) continue;
    const auto column = first + static_cast<Eigen::Index>(limits.size());
    const double size = std::abs(fit.estimate[column]);
    limits.push_back(
        {name_of(candidate), p.name, p.unit,
         (size + rule.half(fit, column, size, rule.placed(candidate.name, p))) * p.typical / p.si_per_unit});
  }
  return limits;
}

/// Limits of a nuisance that is part of the final model.
std::vector<ExclusionLimit> limits_inside(const Effect& effect, const CauseName& name, const Found& found,
                                          const IntervalRule& rule) {
  std::vector<ExclusionLimit> limits;
  for (std::size_t c = 0; c < found.after.parameters.size(); ++c) {
    const auto& ref = found.after.parameters[c];
    if (&found.extended[ref.effect] != &effect) continue;
    const auto& p = effect.parameters()[ref.parameter];
    const double size = std::abs(p.value) / p.typical;
    const double half = rule.half(found.after.fit, static_cast<Eigen::Index>(c), size, rule.placed(name.name, p));
    limits.push_back({name, p.name, p.unit, (size + half) * p.typical / p.si_per_unit});
  }
  return limits;
}

const Effect* effect_of(const ErrorModel& model, const Candidate& candidate) {
  for (std::size_t e = 0; e < model.size(); ++e) {
    if (model[e].name() == candidate.name && model[e].target() == candidate.target) return &model[e];
  }
  return nullptr;
}

}  // namespace

void add_exclusion_limits(MeasurementSource& source, const CoordinateLayout& layout, const BlockPlan& plan,
                          const Found& found, const IntervalRule& rule, DiagnosisReport& report) {
  const BesideTheModel beside(source, layout, plan, found, report.not_testable);
  if (!beside.usable()) return;
  auto& limits = report.exclusion_limits;
  std::vector<CauseName> seen;
  for (const auto& candidate : beside.candidates()) {
    const auto name = name_of(candidate);
    if (is_held_possible(report, name)) continue;
    if (seen.empty() || seen.back() != name) seen.push_back(name);
    if (const auto* effect = effect_of(found.extended, candidate); effect != nullptr && !candidate.slip) {
      const auto inside = limits_inside(*effect, name, found, rule);
      limits.insert(limits.end(), inside.begin(), inside.end());
      continue;
    }
    const auto fit = beside.with(candidate);
    if (!fit.usable) continue;
    for (auto& limit : limits_of(candidate, fit, beside.first(), rule, source.roles())) {
      const bool same_slip = candidate.slip && !limits.empty() && limits.back().cause == name;
      if (!same_slip) {
        limits.push_back(std::move(limit));
      } else if (limit.limit > limits.back().limit) {
        limits.back() = std::move(limit);
      }
    }
  }
  for (const auto& name : seen) {
    const bool limited = std::any_of(limits.begin(), limits.end(), [&](const auto& l) { return l.cause == name; });
    if (!limited) report.not_testable.push_back({name, kLooksAlike});
  }
}

}  // namespace bodyschema::diagnosis
