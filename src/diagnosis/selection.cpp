#include "bodyschema/diagnosis/selection.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <string>

#include "bodyschema/core/error.hpp"

namespace bodyschema {
namespace {

using Ids = std::vector<std::size_t>;

bool contains(const Ids& ids, std::size_t id) {
  return std::find(ids.begin(), ids.end(), id) != ids.end();
}

Ids without(Ids ids, std::size_t id) {
  std::erase(ids, id);
  return ids;
}

Ids with(Ids ids, std::size_t id) {
  ids.push_back(id);
  return ids;
}

/// The same cause at another time is the same cause; so are two shapes of one generic variable.
bool same_cause(const Candidate& a, const Candidate& b) {
  return a.name == b.name && a.target == b.target && a.variable == b.variable;
}

class Selector {
 public:
  Selector(const BlockStatistics& statistics, const Columns& always, const std::vector<Candidate>& candidates,
           const SelectionOptions& options)
      : statistics_(statistics), always_(always), candidates_(candidates), options_(options),
        gain_floor_(options.one_pass ? options.gain_far : options.gain_floor),
        generic_gain_floor_(std::max(gain_floor_, options.generic_gain_floor)) {
    for (std::size_t c = 0; c < candidates.size(); ++c) {
      if (candidates[c].nuisance) model_.push_back(c);
    }
  }

  Selection run() {
    Selection result;
    result.gain_floor = gain_floor_;
    drop_dependent_nuisances(result);
    refit();
    refuse_unusable();
    baseline_ = current_.heldout();
    result.first_scores = score_all();
    for (std::size_t c = 0; c < candidates_.size(); ++c) {
      if (!result.first_scores[c].testable && !contains(result.not_testable, c)) {
        result.not_testable.push_back(c);
      }
    }
    begin_with_given();
    if (options_.search) {
      drop_causes();
      add_causes();
      simplify();
      drop_causes();
      if (options_.given.empty()) stand_out(result);
    }
    for (const auto c : reported()) result.causes.push_back(describe(c));
    weigh_against_no_cause(result.causes);
    std::stable_sort(result.causes.begin(), result.causes.end(),
                     [](const auto& a, const auto& b) { return a.score.gain > b.score.gain; });
    result.model = model_;
    result.last_scores = score_all();
    return result;
  }

 private:
  struct Trial {
    CandidateScore score;
    Eigen::VectorXd loss;  ///< held out, with the candidate
  };

  [[nodiscard]] Columns columns_of(const Ids& ids) const {
    Columns columns = always_;
    for (const auto c : ids) {
      columns.insert(columns.end(), candidates_[c].columns.begin(), candidates_[c].columns.end());
    }
    return columns;
  }

  [[nodiscard]] BlockFit fit(const Ids& ids, std::size_t group = 1) const {
    return statistics_.fit(columns_of(ids), group);
  }

  /// After the model has changed.
  void refit() {
    nested_.emplace(statistics_, columns_of(model_));
    current_ = nested_->base();
    find_floor();
  }

  /// The model with one more candidate.
  [[nodiscard]] BlockFit extended_by(std::size_t candidate) const {
    return nested_->with(candidates_[candidate].columns);
  }

  /// Position of a candidate's first column in the fit of `ids`.
  [[nodiscard]] Eigen::Index position(const Ids& ids, std::size_t candidate) const {
    auto at = static_cast<Eigen::Index>(always_.size());
    for (const auto c : ids) {
      if (c == candidate) break;
      at += static_cast<Eigen::Index>(candidates_[c].columns.size());
    }
    return at;
  }

  /// Wald z of a candidate inside a fit, from the jackknife covariance; where that is smaller than
  /// the catalogue's median dispersion allows (luck, or too few blocks), the median holds.
  /// @param group  as the fit was made with
  [[nodiscard]] double wald_z(const BlockFit& f, const Ids& ids, std::size_t candidate, std::size_t group = 1) const {
    const auto at = position(ids, candidate);
    const auto n = static_cast<Eigen::Index>(candidates_[candidate].columns.size());
    const Eigen::VectorXd theta = f.estimate.segment(at, n);
    Eigen::MatrixXd V = f.covariance.block(at, at, n, n);
    const double dispersion = (V.diagonal().array() / f.model_variance.segment(at, n).array()).mean();
    if (dispersion < floor_) V *= floor_ / dispersion;
    V += 1e-12 * V.trace() * Eigen::MatrixXd::Identity(n, n);
    // Few blocks know the covariance of many columns badly (Hotelling's correction; none for one).
    const double blocks = static_cast<double>(statistics_.seen_blocks(group));
    const double known = std::max(0.0, (blocks - static_cast<double>(n)) / (blocks - 1.0));
    return equivalent_z(known * theta.dot(V.ldlt().solve(theta)), n);
  }

  /// A candidate against the model so far; for one that is in the model, against the model without.
  [[nodiscard]] Trial test(std::size_t candidate) const {
    Trial trial;
    if (contains(model_, candidate)) {
      const auto reduced = fit(without(model_, candidate));
      trial.loss = current_.heldout_loss;
      trial.score.z = wald_z(current_, model_, candidate);
      trial.score.gain = (reduced.heldout() - current_.heldout()) / baseline_;
      trial.score.t = advantage(candidate, reduced.heldout_loss, current_.heldout_loss);
      return trial;
    }
    const auto extended_model = with(model_, candidate);
    const auto extended = extended_by(candidate);
    trial.score.testable = extended.usable;
    if (!extended.usable) return trial;
    trial.loss = extended.heldout_loss;
    trial.score.z = wald_z(extended, extended_model, candidate);
    trial.score.gain = (current_.heldout() - extended.heldout()) / baseline_;
    trial.score.t = advantage(candidate, current_.heldout_loss, extended.heldout_loss);
    return trial;
  }

  /// Paired t of the held-out losses of blocks from..until-1 in which anything was seen; the others' zeros are no
  /// measurements. Large: `a` is worse.
  [[nodiscard]] double seen_t(const Eigen::VectorXd& a, const Eigen::VectorXd& b, Eigen::Index from,
                              Eigen::Index until) const {
    const auto blocks = statistics_.blocks();
    std::vector<Eigen::Index> seen;
    for (auto block = from; block < until; ++block) {
      if (blocks[static_cast<std::size_t>(block)].weight > 0.0) seen.push_back(block);
    }
    return paired_t(a(seen), b(seen));
  }
  [[nodiscard]] double seen_t(const Eigen::VectorXd& a, const Eigen::VectorXd& b) const {
    return seen_t(a, b, 0, a.size());
  }

  /// How clearly the blocks' held-out losses are lower with a candidate. A slip near an end of the log changes few
  /// blocks; it is judged on the side of it where it shows most.
  [[nodiscard]] double advantage(std::size_t candidate, const Eigen::VectorXd& without_it,
                                 const Eigen::VectorXd& with_it) const {
    const double t = seen_t(without_it, with_it);
    if (!candidates_[candidate].slip) return t;
    const auto& begin = candidates_[candidate].columns.front();
    const auto from = static_cast<Eigen::Index>(begin.from_block);
    const Eigen::Index until = from + (begin.from_cell > 0 ? 1 : 0), n = without_it.size();
    return std::max({t, seen_t(without_it, with_it, 0, until), seen_t(without_it, with_it, from, n)});
  }

  [[nodiscard]] bool enters(std::size_t candidate, const CandidateScore& s) const {
    const auto& c = candidates_[candidate];
    const double floor = c.generic() ? generic_gain_floor_ : gain_floor_;
    const double least = std::max(floor * measure_of(c), left_by_shapes());
    return s.testable &&
           z_of_few(s.z, statistics_.seen_blocks(), options_.usual_blocks) > options_.z_asked(c, s.gain) &&
           s.gain > least && s.t > options_.t_enter &&
           (!c.temporal() || s.gain > options_.gain_far || (!tolerable_slip(candidate) && lasts(candidate)));
  }

  /// Whether a slip is no larger than what one puts up with.
  [[nodiscard]] bool tolerable_slip(std::size_t candidate) const {
    const auto& c = candidates_[candidate];
    if (!c.slip || c.tolerance <= 0.0) return false;
    const auto extended_model = with(without(model_, candidate), candidate);
    const auto extended = fit(extended_model);
    return !extended.usable || std::abs(extended.estimate[position(extended_model, candidate)]) < c.tolerance;
  }

  /// Whether a cause in time also predicts stretches that lie far from what its fit has seen. Slow
  /// noise follows any smooth curve into the next block, but not further.
  [[nodiscard]] bool lasts(std::size_t candidate) const {
    auto rest = without(model_, candidate);
    auto plain = fit(rest, options_.far_group);
    if (!plain.usable) {
      // Nor can a slip near an end be fitted without the group that holds it; what others are worth shows beside it.
      std::erase_if(rest, [&](std::size_t c) { return candidates_[c].slip && !fit({c}, options_.far_group).usable; });
      plain = fit(rest, options_.far_group);
    }
    const auto extended_model = with(rest, candidate);
    const auto extended = fit(extended_model, options_.far_group);
    if (!plain.usable) return false;
    if (!extended.usable) return candidates_[candidate].slip;  // near an end: one group holds it all
    const auto z = z_of_few(wald_z(extended, extended_model, candidate, options_.far_group),
                            statistics_.seen_blocks(options_.far_group),
                            (options_.usual_blocks + options_.far_group - 1) / options_.far_group);
    return z > options_.z_far &&
           (plain.heldout() - extended.heldout()) / baseline_ > gain_floor_ * measure_of(candidates_[candidate]);
  }

  [[nodiscard]] std::vector<CandidateScore> score_all() const {
    std::vector<CandidateScore> scores(candidates_.size());
    for (std::size_t c = 0; c < candidates_.size(); ++c) scores[c] = test(c).score;
    return scores;
  }

  /// Nuisances that this log cannot tell from the offsets are not fitted.
  void drop_dependent_nuisances(Selection& result) {
    Ids kept;
    for (const auto c : model_) {
      if (fit(with(kept, c)).usable) {
        kept.push_back(c);
      } else {
        result.not_testable.push_back(c);
      }
    }
    model_ = kept;
  }

  /// Without blocks to hold out, or with offsets that the log cannot tell from each other, nothing that
  /// follows means anything; least of all that nothing was found.
  void refuse_unusable() const {
    constexpr std::size_t kFewestBlocks = 4;
    const auto seen = statistics_.seen_blocks();
    if (current_.usable && seen >= kFewestBlocks) return;
    throw DataError(std::string("the log cannot be diagnosed: ") +
                    (seen < kFewestBlocks ? "the arm stands still in nearly all of it"
                                          : "the arm moves too little to tell the offsets of its joints apart") +
                    "; record 60 to 120 s in which every joint of the arm moves, slow and fast, the same "
                    "postures in both directions");
  }

  /// The catalogue's median dispersion against the present model: what the causes found so far left
  /// unexplained before they were found must not blur those that come after.
  void find_floor() {
    std::vector<double> dispersions;
    for (std::size_t c = 0; c < candidates_.size(); ++c) {
      if (candidates_[c].generic() || candidates_[c].slip) continue;
      const bool inside = contains(model_, c);
      const auto ids = inside ? model_ : with(model_, c);
      const auto f = inside ? current_ : extended_by(c);
      if (!f.usable) continue;
      const auto at = position(ids, c);
      dispersions.push_back(f.covariance(at, at) / f.model_variance[at]);
    }
    if (dispersions.empty()) return;
    const auto middle = dispersions.begin() + static_cast<std::ptrdiff_t>(dispersions.size() / 2);
    std::nth_element(dispersions.begin(), middle, dispersions.end());
    floor_ = *middle;
  }

  /// One step of the greedy search: the candidate that takes away most held-out loss, a generic
  /// feature only where it beats every named cause clearly.
  [[nodiscard]] std::optional<std::size_t> best_addition() const {
    std::optional<std::size_t> named, generic;
    Trial named_trial, generic_trial;
    for (std::size_t c = 0; c < candidates_.size(); ++c) {
      if (contains(model_, c) || blocked(c)) continue;
      auto trial = test(c);
      auto& best = candidates_[c].generic() ? generic : named;
      auto& best_trial = candidates_[c].generic() ? generic_trial : named_trial;
      // The dear test last.
      if ((!best || trial.score.gain > best_trial.score.gain) && enters(c, trial.score)) {
        best = c;
        best_trial = std::move(trial);
      }
    }
    if (!named) return generic;
    if (generic && seen_t(named_trial.loss, generic_trial.loss) > options_.t_generic) {
      return generic;
    }
    return named;
  }

  [[nodiscard]] bool blocked(std::size_t candidate) const {
    return contains(dropped_, candidate) || is_cause(candidate);
  }

  /// Whether it is a cause already, at whatever time: a model holds one slip of a joint. A joint that jumps twice
  /// follows time in a way that no effect of the catalogue does.
  [[nodiscard]] bool is_cause(std::size_t candidate) const {
    return !candidates_[candidate].generic() && std::any_of(causes_.begin(), causes_.end(), [&](std::size_t c) {
      return same_cause(candidates_[c], candidates_[candidate]);
    });
  }

  void begin_with_given() {
    for (const auto c : options_.given) {
      if (contains(model_, c) || !fit(with(model_, c)).usable) continue;
      causes_.push_back(c);
      model_.push_back(c);
    }
    if (options_.given.empty()) return;
    refit();
  }

  /// Held-out loss of the model so far, as a share of the baseline's. Where one cause makes up nearly all of
  /// that, it is what the next one is measured by.
  [[nodiscard]] double share_left() const { return std::min(1.0, current_.heldout() / baseline_); }
  /// What a candidate's gain must be a share of. Beside a large cause all there was, for causes in time: what is
  /// not quite right in the large one's own shape comes and goes with the motion, and looks like a small slip.
  [[nodiscard]] double measure_of(const Candidate& c) const { return c.temporal() ? 1.0 : share_left(); }

  /// Held-out loss that causes leave because their shapes are not quite right (three sigma).
  [[nodiscard]] double left_by_shapes() const {
    return 9.0 * options_.shape_error * options_.shape_error * (1.0 - share_left());
  }

  void add_causes() {
    while (static_cast<int>(causes_.size()) < options_.max_causes) {
      const auto best = best_addition();
      if (!best) return;
      add(*best);
      find_times();
      drop_causes();
    }
  }

  /// Beside what was found after it a slip may fit better at another time.
  void find_times() {
    if (causes_.size() < 2) return;
    for (const auto slip : Ids(causes_)) {
      if (!candidates_[slip].slip) continue;
      remove(slip);
      auto best = slip;
      double most = test(slip).score.gain;
      for (std::size_t c = 0; c < candidates_.size(); ++c) {
        if (!same_cause(candidates_[c], candidates_[slip]) || contains(dropped_, c)) continue;
        const auto score = test(c).score;
        if (score.gain <= most || !enters(c, score)) continue;
        best = c;
        most = score.gain;
      }
      add(best);
    }
  }

  /// Causes that others have made superfluous, the one that is missed least first.
  void drop_causes() {
    while (true) {
      std::optional<std::size_t> least;
      double least_gain = 0.0;
      for (const auto c : causes_) {
        const auto score = test(c).score;
        if (enters(c, score) || (least && score.gain >= least_gain)) continue;
        least = c;
        least_gain = score.gain;
      }
      if (!least) return;
      remove(*least);
      dropped_.push_back(*least);
      if (const auto by_it = replaced_.extract(*least)) {
        model_.insert(model_.begin(), by_it.mapped().begin(), by_it.mapped().end());
        refit();
      }
    }
  }

  void add(std::size_t c) {
    causes_.push_back(c);
    model_.push_back(c);
    refit();
  }

  void remove(std::size_t c) {
    std::erase(causes_, c);
    std::erase(model_, c);
    refit();
  }

  /// Whether a nuisance is clearly larger than what one puts up with.
  [[nodiscard]] bool beyond_tolerance(std::size_t c) const {
    if (candidates_[c].tolerance <= 0.0) return true;
    const auto at = position(model_, c);
    for (std::size_t i = 0; i < candidates_[c].columns.size(); ++i) {
      const auto k = at + static_cast<Eigen::Index>(i);
      const double sd = std::sqrt(current_.covariance(k, k));
      if (std::abs(current_.estimate[k]) - 2.0 * sd > candidates_[c].tolerance) return true;
    }
    return false;
  }

  /// Causes and nuisances that the data asks for.
  [[nodiscard]] Ids reported() const {
    Ids list;
    for (const auto c : model_) {
      // What crowds in on a nuisance once others are set aside is of the crowd as well.
      if (standing_ && !contains(*standing_, c)) continue;
      if (contains(causes_, c) || (enters(c, test(c).score) && beyond_tolerance(c))) list.push_back(c);
    }
    return list;
  }

  /// Where many small errors live together, the largest of them is a cause like any other on a clean log, but
  /// not what is wrong with the robot. Sets aside what does not stand out from all that is smaller.
  void stand_out(Selection& result) {
    find_rest(result);
    std::vector<SelectedCause> list;
    for (const auto c : reported()) list.push_back({.candidate = c, .score = test(c).score});
    std::stable_sort(list.begin(), list.end(),
                     [](const auto& a, const auto& b) { return a.score.gain > b.score.gain; });
    const double left = share_left(), rest = std::max(0.0, result.rest_gain);
    const bool many =
        list.size() >= options_.crowd || (list.size() > 1 && too_small_for_a_crowd(list.front().candidate));
    if (!many && result.rest_t <= options_.crowd_rest_t) return;
    // The crowd is what stands below the last cause that is large in what the larger ones leave, and larger
    // than all the smaller ones together. Of one or two causes none needs to be large beside next to nothing.
    double crowd = rest;
    while (!list.empty() && result.set_aside.size() < list.size()) {
      const auto& smallest = list[list.size() - 1 - result.set_aside.size()];
      const double gain = smallest.score.gain, without_it = left + crowd - rest + gain;
      const bool alone = !many && crowd <= options_.gain_floor * left;
      const bool large =
          alone || (gain > options_.crowd_floor * without_it && !too_small_for_a_crowd(smallest.candidate));
      if (large && gain > options_.crowd_ratio * crowd) break;
      crowd += gain;
      result.set_aside.push_back(smallest);
    }
    std::reverse(result.set_aside.begin(), result.set_aside.end());
    standing_.emplace();
    for (std::size_t k = 0; k < list.size() - result.set_aside.size(); ++k) standing_->push_back(list[k].candidate);
    for (const auto& cause : result.set_aside) {
      if (contains(causes_, cause.candidate)) remove(cause.candidate);
    }
    result.crowded = crowd > options_.crowd_worth * (left + crowd);
  }

  [[nodiscard]] bool too_small_for_a_crowd(std::size_t c) const {
    const auto columns = static_cast<Eigen::Index>(candidates_[c].columns.size());
    return current_.estimate.segment(position(model_, c), columns).norm() < candidates_[c].detectable;
  }

  /// One cause outside the baseline can look like several nuisances inside it. Where one candidate
  /// makes two or more reported causes superfluous and the fit stays as good, it replaces them.
  void simplify() {
    for (int round = 0; round < 3; ++round) {
      const auto list = reported();
      if (list.size() < 2) return;
      std::optional<std::size_t> best;
      Ids best_killed;
      double best_loss = 0.0;
      for (std::size_t a = 0; a < candidates_.size(); ++a) {
        if (contains(model_, a) || candidates_[a].generic() || blocked(a)) continue;
        const auto extended_model = with(model_, a);
        const auto extended = extended_by(a);
        if (!extended.usable) continue;
        Ids killed;
        for (const auto c : list) {
          if (wald_z(extended, extended_model, c) < options_.z_same) killed.push_back(c);
        }
        if (killed.size() < 2) continue;
        auto reduced_model = extended_model;
        for (const auto c : killed) std::erase(reduced_model, c);
        const auto reduced = fit(reduced_model);
        if (!reduced.usable || seen_t(reduced.heldout_loss, current_.heldout_loss) > options_.t_same) {
          continue;
        }
        if (!best || killed.size() > best_killed.size() ||
            (killed.size() == best_killed.size() && reduced.heldout() < best_loss)) {
          best = a;
          best_killed = killed;
          best_loss = reduced.heldout();
        }
      }
      if (!best) return;
      for (const auto c : best_killed) {
        auto& replaced = replaced_[*best];
        if (candidates_[c].nuisance) replaced.push_back(c);
        const auto by_it = replaced_.extract(c);
        if (by_it) replaced.insert(replaced.end(), by_it.mapped().begin(), by_it.mapped().end());
        remove(c);
      }
      add(*best);
    }
  }

  /// The class of a cause: every candidate that explains it away and, in its place, is not clearly
  /// worse on held-out blocks. The one that does best is listed first.
  [[nodiscard]] SelectedCause describe(std::size_t cause) const {
    SelectedCause result{.candidate = cause, .score = test(cause).score};
    result.gain_judged = result.score.gain;
    if (const auto by_it = replaced_.find(cause); by_it != replaced_.end()) result.replaced = by_it->second;
    if (candidates_[cause].generic()) return result;
    result.wanders = candidates_[cause].temporal() && wanders(candidates_[cause].target);
    const NestedFits rest(statistics_, columns_of(without(model_, cause)));
    std::vector<std::pair<double, std::size_t>> same;
    for (std::size_t a = 0; a < candidates_.size(); ++a) {
      if (contains(model_, a) || candidates_[a].generic() || is_cause(a)) continue;
      const auto both_model = with(model_, a);
      const auto both = extended_by(a);
      const auto instead = rest.with(candidates_[a].columns);
      if (!instead.usable) continue;
      // Exactly aliased ones cannot be fitted together at all.
      if (both.usable && both.independent > options_.alike && wald_z(both, both_model, cause) > options_.z_same)
        continue;
      if (instead.heldout() - current_.heldout() > options_.least_worse * baseline_ &&
          seen_t(instead.heldout_loss, current_.heldout_loss) > options_.t_same) {
        continue;
      }
      same.emplace_back(instead.heldout(), a);
    }
    std::sort(same.begin(), same.end());
    for (const auto& [loss, a] : same) {
      const bool listed = std::any_of(result.same.begin(), result.same.end(),
                                      [&](std::size_t b) { return same_cause(candidates_[a], candidates_[b]); });
      if (!listed) result.same.push_back(a);
    }
    if (!same.empty() && same.front().first < current_.heldout()) {
      std::swap(result.candidate, result.same.front());
      result.score = score_instead(result.candidate, cause, rest);
      result.gain_judged = result.score.gain;
    }
    return result;
  }

  /// How a candidate fares in the place of a cause.
  /// @param rest  the model without the cause
  [[nodiscard]] CandidateScore score_instead(std::size_t candidate, std::size_t cause, const NestedFits& rest) const {
    const auto fit = rest.with(candidates_[candidate].columns);
    return {wald_z(fit, with(without(model_, cause), candidate), candidate),
            (rest.base().heldout() - fit.heldout()) / baseline_,
            advantage(candidate, rest.base().heldout_loss, fit.heldout_loss), true};
  }

  /// Gains as shares of the loss of offsets and those nuisances that are not causes themselves: a
  /// nuisance that is one is otherwise judged by the loss it has already taken away.
  void weigh_against_no_cause(std::vector<SelectedCause>& causes) const {
    Ids rest;
    for (const auto c : model_) {
      const bool found = std::any_of(causes.begin(), causes.end(), [&](const auto& cause) {
        return cause.candidate == c || contains(cause.same, c);
      });
      if (!found) rest.push_back(c);
    }
    const auto plain = fit(rest);
    if (!plain.usable || plain.heldout() <= 0.0) return;
    for (auto& cause : causes) cause.score.gain *= baseline_ / plain.heldout();
  }

  /// Whether a free curve in time of the joint takes something away that slip or drift leaves.
  [[nodiscard]] bool wanders(const EffectTarget& joint) const {
    for (std::size_t c = 0; c < candidates_.size(); ++c) {
      const auto& candidate = candidates_[c];
      if (!candidate.generic() || candidate.variable != "time" || !(candidate.target == joint)) continue;
      const auto score = test(c).score;
      if (score.testable && score.z > options_.z_wander && score.gain > options_.gain_floor) return true;
    }
    return false;
  }

  /// What all other causes of the catalogue would explain together if each were small.
  void find_rest(Selection& result) const {
    constexpr double kSmall = 0.2;  // of a typical size
    auto columns = columns_of(model_);
    const auto own = columns.size();
    for (std::size_t c = 0; c < candidates_.size(); ++c) {
      const auto& candidate = candidates_[c];
      if (candidate.generic() || candidate.slip || contains(model_, c)) continue;
      columns.insert(columns.end(), candidate.columns.begin(), candidate.columns.end());
    }
    Eigen::VectorXd precision = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(columns.size()));
    precision.tail(static_cast<Eigen::Index>(columns.size() - own)).setConstant(floor_ / (kSmall * kSmall));
    const auto loss = statistics_.heldout_with_prior(columns, precision);
    result.rest_gain = (current_.heldout() - loss.sum()) / baseline_;
    result.rest_t = seen_t(current_.heldout_loss, loss);
  }

  const BlockStatistics& statistics_;
  const Columns& always_;
  const std::vector<Candidate>& candidates_;
  const SelectionOptions& options_;
  double gain_floor_;  ///< least gain of a cause
  double generic_gain_floor_;
  Ids model_;                            ///< candidates in the fit: nuisances, then causes
  Ids causes_;                           ///< those that were added
  Ids dropped_;                          ///< and those that were dropped again: not tried twice
  std::map<std::size_t, Ids> replaced_;  ///< by a cause: nuisances that it made superfluous together
  std::optional<Ids> standing_;          ///< those that stand out, where there is a crowd
  std::optional<NestedFits> nested_;     ///< about model_
  BlockFit current_;
  double baseline_ = 1.0;
  double floor_ = 0.0;  ///< least dispersion of a candidate
};

}  // namespace

std::string Candidate::description() const {
  std::string text = generic() ? "unexplained " + variable : name;
  if (!target.joint.empty()) text += (generic() ? " on " : " of ") + target.joint;
  if (!target.source.empty()) text += (target.joint.empty() ? " " : " with ") + target.source;
  return text;
}

Selection select_causes(const BlockStatistics& statistics, const Columns& always,
                        const std::vector<Candidate>& candidates, const SelectionOptions& options) {
  return Selector(statistics, always, candidates, options).run();
}

}  // namespace bodyschema
