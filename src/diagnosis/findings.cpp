#include "findings.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <span>
#include <spdlog/fmt/fmt.h>
#include <utility>
#include <vector>

#include "exclusion.hpp"
#include "interval.hpp"
#include "nearer_model.hpp"

namespace bodyschema::diagnosis {
namespace {

constexpr double kDeg = kPi / 180.0;

CauseName cause_of(const Effect& effect) {
  return {effect.name(), effect.target().joint, effect.target().source};
}

std::optional<Microseconds> begin_of(const Effect& effect) {
  if (effect.name() != "slip" && effect.name() != "drift") return std::nullopt;
  return microseconds(effect.parameters()[1].value);
}

std::optional<double> duration_of(const Effect& effect) {
  if (effect.name() != "drift") return std::nullopt;
  return effect.parameters()[2].value;
}

/// Views [first, last) of one instant, one a camera, in whatever order they are stamped: nearer to each
/// other than half the time to a camera's next picture.
std::vector<std::pair<std::size_t, std::size_t>> instants_of(std::span<const ViewInput> views) {
  constexpr Microseconds kFurthest = 50'000, kRepeated = 5'000;
  std::map<std::size_t, Microseconds> last_of;
  std::vector<Microseconds> periods;
  for (const auto& view : views) {
    const auto last = last_of.find(view.camera);
    const auto period = last != last_of.end() ? view.joints.utime - last->second : 0;
    if (period > kRepeated) periods.push_back(period);
    last_of[view.camera] = view.joints.utime;
  }
  Microseconds apart = kFurthest;
  if (!periods.empty()) {
    const auto middle = periods.begin() + static_cast<std::ptrdiff_t>(periods.size() / 2);
    std::nth_element(periods.begin(), middle, periods.end());
    apart = std::min(apart, *middle / 2);
  }
  std::vector<std::pair<std::size_t, std::size_t>> instants;
  for (std::size_t first = 0, v = 0; v < views.size(); first = v) {
    std::set<std::size_t> cameras;
    while (v < views.size() && views[v].joints.utime - views[first].joints.utime <= apart &&
           cameras.insert(views[v].camera).second) {
      ++v;
    }
    instants.emplace_back(first, v);
  }
  return instants;
}

class Findings {
 public:
  Findings(MeasurementSource& source, const SelectionOptions& rules, const CoordinateLayout& layout,
           const BlockPlan& plan, const Found& found, const ErrorModel& baseline, const ModelFit& before,
           double systematic_share, const std::map<std::string, double>& systematic_error)
      : source_(source), rules_(rules), layout_(layout), plan_(plan), found_(found), baseline_(baseline),
        before_(before),
        rule_(found.after.fit, found.after.statistics->seen_blocks(), systematic_share, systematic_error),
        jacobians_(source.views().size()) {}

  DiagnosisReport report(const std::vector<NotTestable>& excluded) {
    DiagnosisReport report;
    add_facts(report);
    report.not_testable = excluded;
    add_uninformed(report);
    report.crowded = found_.selection.crowded;
    add_causes(report);
    add_exclusion_limits(source_, layout_, plan_, found_, rule_, report);
    add_bars(report);
    add_offsets(report);
    report.before = heldout(before_, report, true);
    report.after = heldout(found_.after, report, false);
    report.joint_corrections_before = joint_corrections(before_.at);
    report.joint_corrections_after = joint_corrections(found_.after.at);
    report.baseline_model = baseline_;
    report.extended_model = found_.extended;
    add_part_out_of_sight(report);
    add_warnings(report);
    return report;
  }

 private:
  /// @param common  of the value, what all blocks err in alike
  [[nodiscard]] std::array<double, 2> interval(Eigen::Index column, const Effect& effect, const EffectParameter& p,
                                               double common) const {
    const double placed = rule_.placed(effect.name(), p);
    const double half = rule_.half(found_.after.fit, column, common / p.typical, placed) * p.typical;
    return {p.value - half, p.value + half};
  }

  void add_facts(DiagnosisReport& report) const {
    report.begin_utime = source_.views().front().joints.utime;
    report.z_threshold = rules_.z_enter;
    report.gain_threshold = found_.selection.gain_floor;
    report.z_threshold_large = rules_.z_large;
    report.gain_large = rules_.gain_large;
    report.duration_s = seconds(source_.views().back().joints.utime - source_.views().front().joints.utime);
    report.block_s = plan_.length_s;
    report.noise_correlation_s = plan_.correlation_s;
    report.views = source_.views().size();
    report.blocks = plan_.block_count();
    const auto& roles = source_.roles();
    for (const auto joint : roles.arm) {
      report.arm_joints.push_back(roles.names[static_cast<std::size_t>(joint)]);
    }
  }

  void add_uninformed(DiagnosisReport& report) const {
    for (const auto c : found_.selection.not_testable) {
      const auto& candidate = found_.set.candidates[c];
      if (candidate.generic() || candidate.slip) continue;
      report.not_testable.push_back(
          {name_of(candidate), "in this log it looks exactly like the joint offsets or what is fitted already"});
    }
  }

  void add_causes(DiagnosisReport& report) const {
    const auto& candidates = found_.set.candidates;
    for (const auto& selected : found_.selection.causes) {
      const auto& candidate = candidates[selected.candidate];
      DiagnosedCause cause;
      cause.cause = name_of(candidate);
      cause.variable = candidate.variable;
      cause.z = selected.score.z;
      cause.heldout_gain = selected.score.gain;
      cause.same.push_back(cause.cause);
      for (const auto c : selected.same) cause.same.push_back(name_of(candidates[c]));
      for (const auto& other : lookalikes(source_, cause.cause)) {
        if (std::find(cause.same.begin(), cause.same.end(), other) == cause.same.end()) cause.same.push_back(other);
      }
      if (selected.wanders) cause.same.push_back({"unexplained", cause.cause.joint, ""});
      if (cause.same.size() > 1) cause.advice = splitting_motion(cause.same);
      for (std::size_t c = 0; c < found_.after.parameters.size(); ++c) {
        const auto& ref = found_.after.parameters[c];
        if (cause_of(found_.extended[ref.effect]) != cause.cause) continue;
        const auto& p = found_.extended[ref.effect].parameters()[ref.parameter];
        cause.implausible = !plausible(found_.extended[ref.effect]);
        const auto ci = interval(static_cast<Eigen::Index>(c), found_.extended[ref.effect], p, std::abs(p.value));
        cause.parameters.push_back({p.name,
                                    p.unit,
                                    p.in_unit(),
                                    {ci[0] / p.si_per_unit, ci[1] / p.si_per_unit},
                                    begin_of(found_.extended[ref.effect]),
                                    duration_of(found_.extended[ref.effect])});
      }
      const bool listed = std::any_of(report.causes.begin(), report.causes.end(), [&](const auto& c) {
        return c.cause == cause.cause && c.variable == cause.variable;
      });
      if (!listed) report.causes.push_back(std::move(cause));
    }
  }

  void add_bars(DiagnosisReport& report) const {
    for (std::size_t c = 0; c < found_.set.candidates.size(); ++c) {
      const auto& first = found_.selection.first_scores[c];
      const auto& last = found_.selection.last_scores[c];
      const auto label = found_.set.candidates[c].description();
      auto bar = std::find_if(report.bars.begin(), report.bars.end(), [&](const auto& b) { return b.label == label; });
      if (bar == report.bars.end()) {
        const auto& candidate = found_.set.candidates[c];
        report.bars.push_back({label, candidate.generic(), candidate.nuisance, first.testable, 0.0, 0.0, 0.0, 0.0});
        bar = report.bars.end() - 1;
      }
      // Slips at other times and other shapes of a generic variable share a bar: the best counts.
      bar->z_before = std::max(bar->z_before, first.z);
      // A nuisance is part of the first model: its gain is a share of the loss without it.
      const double gain =
          found_.set.candidates[c].nuisance && first.gain > 0.0 ? first.gain / (1.0 + first.gain) : first.gain;
      bar->gain_before = std::max(bar->gain_before, gain);
      bar->z_after = std::max(bar->z_after, last.z);
      bar->gain_after = std::max(bar->gain_after, last.gain);
    }
  }

  void add_offsets(DiagnosisReport& report) const {
    const auto& roles = source_.roles();
    for (const auto joint : roles.arm) {
      const auto& name = roles.names[static_cast<std::size_t>(joint)];
      report.offsets_deg_before[name] = degrees(baseline_.offsets()[joint]);
      report.offsets_deg_after[name] = degrees(found_.extended.offsets()[joint]);
    }
    for (std::size_t c = 0; c < found_.after.parameters.size(); ++c) {
      const auto& ref = found_.after.parameters[c];
      const auto& effect = found_.extended[ref.effect];
      if (effect.name() != "joint_offset") continue;
      const auto& p = effect.parameters()[ref.parameter];
      const auto ci = interval(static_cast<Eigen::Index>(c), effect, p, 0.0);
      report.offsets_ci95_deg[effect.target().joint] = {degrees(ci[0]), degrees(ci[1])};
    }
  }

  void add_part_out_of_sight(DiagnosisReport& report) const {
    constexpr double kUnlike = 8.0, kShare = 0.05;
    const auto turn = turning(source_, found_.after.at);
    if (!turn || turn->unlike < kUnlike || turn->worse_share < kShare) return;
    const double at_s = turn->time_s - seconds(report.begin_utime);
    report.out_of_sight = turn->later_is_worse ? PartOutOfSight{at_s, report.duration_s, turn->worse_share}
                                               : PartOutOfSight{0.0, at_s, turn->worse_share};
    const auto& part = *report.out_of_sight;
    report.warnings.push_back(
        fmt::format("from {:.1f} to {:.1f} s ({:.0f} % of the pictures) the outlines are out of the model's sight: "
                    "something moved further than can be followed, or what is seen there is not the hand; nothing is "
                    "known of that part",
                    part.from_s, part.to_s, 100.0 * part.share));
  }

  void add_warnings(DiagnosisReport& report) const {
    if (plan_.correlation_s <= 0.0) {
      report.warnings.push_back(
          "no rest of 3 s or more in which one camera saw the arm 16 times (repeats of the "
          "picture before do not count): the noise's correlation time is not measured, blocks "
          "are " +
          std::to_string(std::lround(plan_.length_s)) + " s");
    }
    std::string list;
    for (const auto& cause : found_.selection.set_aside) {
      list += (list.empty() ? "" : ", ") + found_.set.candidates[cause.candidate].description();
    }
    if (found_.selection.crowded) {
      report.warnings.push_back("several small errors share what is left" +
                                (list.empty() ? "" : "; none stands out among " + list));
    } else if (!list.empty()) {
      report.warnings.push_back("too small to be told from what else is slightly wrong: " + list);
    }
    if (passes_once(source_)) {
      report.warnings.push_back(
          "every joint moved one way only: what follows an angle looks like what follows "
          "time; pass the same postures several times, in both directions");
    }
    if (report.duration_s < 30.0) {
      report.warnings.push_back("the log is shorter than 30 s: small causes stay hidden");
    }
  }

  [[nodiscard]] Eigen::MatrixXd joint_corrections(const Linearisation& at) const {
    const auto& arm = source_.roles().arm;
    Eigen::MatrixXd result(static_cast<Eigen::Index>(at.corrections.size()), static_cast<Eigen::Index>(arm.size()));
    for (Eigen::Index v = 0; v < result.rows(); ++v) {
      for (Eigen::Index j = 0; j < result.cols(); ++j) {
        result(v, j) = at.corrections[static_cast<std::size_t>(v)].dq[arm[static_cast<std::size_t>(j)]];
      }
    }
    return result;
  }

  /// What a fit without its block leaves of a view, by coordinate, and its loss.
  struct Rest {
    Eigen::VectorXd vector;
    double loss;
  };
  /// @param with_curves  also without the free curves of an unexplained cause, beside which all else was fitted
  [[nodiscard]] Rest held_out(const ModelFit& fit, std::size_t v, bool with_curves) const {
    const auto& view = fit.at.views[v];
    Eigen::VectorXd x = Eigen::VectorXd::Zero(layout_.size());
    if (fit.fit.usable) {
      const auto replica = fit.fit.replicas.col(static_cast<Eigen::Index>(plan_.block_of_view[v]));
      const std::size_t parameters = fit.columns.size();
      for (std::size_t c = 0; c < parameters + (with_curves ? fit.extra.size() : 0); ++c) {
        const auto& column = c < parameters ? fit.columns[c] : fit.extra[c - parameters];
        for (const auto& e : column.views[v]) {
          x[static_cast<Eigen::Index>(e.coordinate)] +=
              static_cast<double>(e.value) * replica[static_cast<Eigen::Index>(c)];
        }
      }
    }
    Rest rest{view.vector - view.information * x, 0.0};
    rest.loss = view.square - x.dot(view.vector) - x.dot(rest.vector);
    return rest;
  }

  /// @param view  in which something was found
  [[nodiscard]] Remainder remainder_of(const Rest& rest, const CompressedView& view) const {
    Remainder remainder;
    remainder.rms_px = std::sqrt(std::max(0.0, rest.loss / view.weight));
    remainder.mean_px = rest.vector[layout_.size() - 1] / view.weight;
    for (std::size_t j = 0; j < source_.roles().arm.size(); ++j) {
      const auto at = static_cast<Eigen::Index>(j);
      const double information = view.information(at, at);
      remainder.apparent_deg.push_back(information > 0.0 ? degrees(rest.vector[at] / information) : 0.0);
    }
    return remainder;
  }

  void describe_view(const ModelFit& fit, std::size_t v, ResidualSample& sample) const {
    const auto views = source_.views();
    sample.time_s = seconds(views[v].joints.utime - views.front().joints.utime);
    sample.camera = views[v].camera;
    for (const auto joint : source_.roles().arm) {
      sample.angle_deg.push_back(degrees(fit.at.instants[v].q[joint]));
      sample.velocity_deg_s.push_back(degrees(fit.at.instants[v].qdot[joint]));
      sample.acceleration_deg_s2.push_back(degrees(fit.at.instants[v].qddot[joint]));
      sample.torque_nm.push_back(fit.at.instants[v].gravity_torque.size() > 0 ? fit.at.instants[v].gravity_torque[joint]
                                                                              : 0.0);
    }
  }

  /// Held-out residuals, and the motion of the hand that they ask for.
  HeldoutError heldout(const ModelFit& fit, DiagnosisReport& report, bool before) {
    HeldoutError error;
    const auto views = source_.views();
    const auto arm = static_cast<Eigen::Index>(source_.roles().arm.size());
    double square = 0.0, weight = 0.0, mm2 = 0.0, deg2 = 0.0, outline = 0.0, matched = 0.0;
    double outline_seen = 0.0, matched_seen = 0.0;
    std::size_t hands = 0;
    if (before) report.samples.resize(views.size());
    Eigen::MatrixXd A(arm, arm);
    Eigen::VectorXd b(arm);
    for (const auto& [first, last] : instants_of(views)) {
      A.setZero();
      b.setZero();
      std::size_t seen = last;
      for (auto v = first; v < last; ++v) {
        const auto& view = fit.at.views[v];
        auto& sample = report.samples[v];
        if (before) describe_view(fit, v, sample);
        auto& remainder = before ? sample.before : sample.after;
        remainder.apparent_deg.assign(static_cast<std::size_t>(arm), 0.0);
        if (!before) sample.noise = remainder;
        outline += view.outline;
        matched += view.matched;
        if (view.weight <= 0.0) continue;
        seen = v;
        outline_seen += view.outline;
        matched_seen += view.matched;
        const auto left = held_out(fit, v, true);
        square += plan_.weight_of_view[v] * left.loss;
        weight += plan_.weight_of_view[v] * view.weight;
        // Charts show what the extended model leaves: a curve that nothing explains stays in sight.
        remainder = remainder_of(fit.extra.empty() ? left : held_out(fit, v, false), view);
        if (!before) sample.noise = remainder_of(left, view);
        A += view.information.topLeftCorner(arm, arm);
        b += left.vector.head(arm);
      }
      if (seen == last) continue;
      // The correction of all arm joints, held by a weak prior.
      A.diagonal().array() += 0.25 / (1.0 * kDeg * 1.0 * kDeg);  // (0.5 px)^2 against 1 deg
      const auto& jacobian = jacobian_at(seen, fit.at.corrections[seen]);
      const Eigen::VectorXd motion = jacobian.leftCols(arm) * A.ldlt().solve(b);
      mm2 += motion.head<3>().squaredNorm() * 1e6;
      deg2 += motion.tail<3>().squaredNorm() / (kDeg * kDeg);
      ++hands;
    }
    error.rms_px = weight > 0.0 ? std::sqrt(std::max(0.0, square / weight)) : 0.0;
    if (outline > 0.0) error.outline_found = matched / outline;
    if (outline_seen > 0.0) error.outline_where_seen = matched_seen / outline_seen;
    if (hands > 0) {
      error.hand_mm = std::sqrt(mm2 / static_cast<double>(hands));
      error.hand_deg = std::sqrt(deg2 / static_cast<double>(hands));
    }
    return error;
  }

  const Eigen::MatrixXd& jacobian_at(std::size_t view, const Corrections& corrections) {
    if (jacobians_[view].size() == 0) jacobians_[view] = source_.hand_jacobian(view, corrections);
    return jacobians_[view];
  }

  MeasurementSource& source_;
  const SelectionOptions& rules_;
  const CoordinateLayout& layout_;
  const BlockPlan& plan_;
  const Found& found_;
  const ErrorModel& baseline_;
  const ModelFit& before_;
  IntervalRule rule_;
  std::vector<Eigen::MatrixXd> jacobians_;
};

}  // namespace

CauseName name_of(const Candidate& candidate) {
  return {candidate.name, candidate.target.joint, candidate.target.source};
}

DiagnosisReport findings(MeasurementSource& source, const SelectionOptions& rules, const CoordinateLayout& layout,
                         const BlockPlan& plan, const Found& found, const ErrorModel& baseline, const ModelFit& before,
                         const std::vector<NotTestable>& excluded, double systematic_share,
                         const std::map<std::string, double>& systematic_error) {
  return Findings(source, rules, layout, plan, found, baseline, before, systematic_share, systematic_error)
      .report(excluded);
}

}  // namespace bodyschema::diagnosis
