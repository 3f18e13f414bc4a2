#include <algorithm>
#include <cmath>
#include <limits>

#include "bodyschema/diagnosis_trials/trials.hpp"

namespace bodyschema {
namespace {

/// Gain and eccentricity of one joint count as one.
bool equivalent(const CauseName& a, const CauseName& b) {
  if (a == b) return true;
  const auto is_scale = [](const CauseName& c) { return c.name == "encoder_gain" || c.name == "eccentricity"; };
  return is_scale(a) && is_scale(b) && a.joint == b.joint;
}

bool holds(const DiagnosedCause& cause, const TrialFault& truth) {
  return std::any_of(cause.same.begin(), cause.same.end(), [&](const auto& c) { return equivalent(c, truth.cause); });
}

/// Something counted against how often it could have been.
struct Share {
  std::size_t part = 0, whole = 0;
  void add(bool hit) {
    part += hit;
    ++whole;
  }
  [[nodiscard]] double value() const {
    return whole > 0 ? static_cast<double>(part) / static_cast<double>(whole)
                     : std::numeric_limits<double>::quiet_NaN();
  }
};

double quantile(std::vector<double> values, double q) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(q * static_cast<double>(values.size() - 1) + 0.5)];
}

/// The parameter of the catalogue's effect that a fault's first or second value is.
std::string parameter_of(const TrialFault& truth) {
  const auto& name = truth.cause.name;
  const bool second = truth.value == 0.0;
  if (name == "axis_tilt") return second ? "tilt_2" : "tilt_1";
  if (name == "principal_point") return second ? "cy" : "cx";
  if (name == "eccentricity") return "sine";
  return "";
}

class Scores {
 public:
  void add(const TrialOutcome& o) {
    ++rates_.trials[static_cast<std::size_t>(o.row)];
    rates_.refused[static_cast<std::size_t>(o.row)] += o.refused;
    const auto& causes = o.report.causes;
    switch (o.row) {
      case TrialRow::kNull: alarm_.add(o.refused || !causes.empty()); break;
      case TrialRow::kBackground:
        named_.add(o.refused ||
                   std::any_of(causes.begin(), causes.end(), [](const auto& c) { return c.heldout_gain > 0.05; }));
        break;
      case TrialRow::kSingle: add_single(o); break;
      case TrialRow::kLimit: limit_wrong_.add(o.refused || wrong_name(o.report, o.truth.front())); break;
      case TrialRow::kTwo: add_two(o); break;
      case TrialRow::kOutside: unexplained_.add(says_unexplained(o)); break;
      case TrialRow::kOutsideHard: add_hard(o); break;
    }
  }

  [[nodiscard]] TrialRates result() {
    auto& r = rates_;
    r.null_false_alarm = alarm_.value();
    r.background_named = named_.value();
    r.single_in_class = in_.value();
    r.single_exact = exact_.value();
    r.single_wrong = wrong_.value();
    r.single_mean_class = class_size_.value();
    r.limit_wrong = limit_wrong_.value();
    r.two_both = both_.value();
    r.two_spurious = spurious_.value();
    r.outside_unexplained = unexplained_.value();
    r.outside_hard_joint = hard_joint_.value();
    r.outside_hard_class_or_unexplained = hard_soft_.value();
    r.parameters = errors_.size();
    r.sign = sign_.value();
    r.error_median = quantile(errors_, 0.5);
    r.error_p90 = quantile(errors_, 0.9);
    r.coverage95 = covered_.value();
    r.gains = excess_.size();
    r.removable_excess_median = quantile(excess_, 0.5);
    r.offset_improvement_median = quantile(improvement_, 0.5);
    return r;
  }

 private:
  static bool says_unexplained(const TrialOutcome& o) {
    return std::any_of(o.report.causes.begin(), o.report.causes.end(),
                       [](const auto& c) { return c.cause.name == "unexplained"; });
  }

  void add_single(const TrialOutcome& o) {
    const auto& truth = o.truth.front();
    const bool found = in_class(o.report, truth);
    in_.add(found);
    exact_.add(named_exactly(o.report, truth));
    wrong_.add(wrong_name(o.report, truth));
    for (const auto& cause : o.report.causes) {
      if (!holds(cause, truth)) continue;
      class_size_.part += cause.same.size();
      ++class_size_.whole;
      break;
    }
    add_parameters(o, truth);
    if (!found) return;
    if (o.removed_share) excess_.push_back(*o.removed_share);
    if (o.offset_error_after_deg > 0.0) {
      improvement_.push_back(o.offset_error_before_deg / o.offset_error_after_deg);
    }
  }

  void add_two(const TrialOutcome& o) {
    both_.add(in_class(o.report, o.truth[0]) && in_class(o.report, o.truth[1]));
    spurious_.add(std::any_of(o.report.causes.begin(), o.report.causes.end(),
                              [&](const auto& c) { return !holds(c, o.truth[0]) && !holds(c, o.truth[1]); }));
    for (const auto& truth : o.truth) add_parameters(o, truth);
  }

  /// The right joint and variable: a kink follows the joint's angle, a walk time.
  void add_hard(const TrialOutcome& o) {
    const auto& truth = o.truth.front();
    const bool in_time = truth.cause.name == "random_walk";
    const auto& causes = o.report.causes;
    hard_joint_.add(std::any_of(causes.begin(), causes.end(), [&](const auto& c) {
      if (c.cause.joint != truth.cause.joint) return false;
      const auto& n = c.cause.name;
      if (n == "unexplained") return c.variable == (in_time ? "time" : "angle");
      return in_time ? n == "slip" || n == "drift" : n == "encoder_gain" || n == "eccentricity";
    }));
    hard_soft_.add(says_unexplained(o) ||
                   std::any_of(causes.begin(), causes.end(), [](const auto& c) { return c.same.size() > 1; }));
  }

  void add_parameters(const TrialOutcome& o, const TrialFault& truth) {
    const auto wanted = parameter_of(truth);
    const double value = truth.value == 0.0 ? truth.second : truth.value;
    for (const auto& cause : o.report.causes) {
      if (!(cause.cause == truth.cause)) continue;
      for (const auto& p : cause.parameters) {
        if (!wanted.empty() && p.parameter != wanted) continue;
        sign_.add(p.estimate * value > 0.0);
        errors_.push_back(std::abs(p.estimate - value) / std::abs(value));
        covered_.add(p.ci95[0] <= value && value <= p.ci95[1]);
        break;
      }
    }
  }

  TrialRates rates_;
  Share alarm_, named_, in_, exact_, wrong_, class_size_, limit_wrong_, both_, spurious_, unexplained_, hard_joint_,
      hard_soft_, sign_, covered_;
  std::vector<double> errors_, excess_, improvement_;
};

}  // namespace

bool in_class(const DiagnosisReport& report, const TrialFault& truth) {
  return std::any_of(report.causes.begin(), report.causes.end(),
                     [&](const auto& cause) { return holds(cause, truth); });
}

bool named_exactly(const DiagnosisReport& report, const TrialFault& truth) {
  return !report.causes.empty() && equivalent(report.causes.front().cause, truth.cause);
}

bool wrong_name(const DiagnosisReport& report, const TrialFault& truth) {
  return !report.causes.empty() && !in_class(report, truth);
}

TrialRates rates(const std::vector<TrialOutcome>& outcomes) {
  Scores scores;
  for (const auto& outcome : outcomes) scores.add(outcome);
  return scores.result();
}

}  // namespace bodyschema
