#include "bodyschema/diagnosis/diagnoser.hpp"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "block_regression.hpp"
#include "bodyschema/core/error.hpp"
#include "bodyschema/evidence/distributions.hpp"
#include "candidates.hpp"
#include "findings.hpp"
#include "limits.hpp"
#include "log_length.hpp"
#include "log_motion.hpp"
#include "look.hpp"
#include "model_search.hpp"
#include "verdict.hpp"

namespace bodyschema {
namespace diagnosis {
namespace {

class Diagnoser {
 public:
  Diagnoser(LogFit& fit, ModelSearch search, const DiagnosisOptions& options, std::vector<Microseconds> changes = {})
      : fit_(fit), options_(options), search_(std::move(search)), changes_(std::move(changes)) {}

  DiagnosisReport run() {
    report_.not_testable = untestable(fit_.log().roles(), motion());
    refuse_unusable();
    progress(0.02);
    search_.start();
    search_.look_for_lost_part();
    search_.polish(options_.block_s);
    progress(0.2);
    Findings findings(fit_, search_, options_, report_);
    const auto begin = search_.about(options_.block_s);
    findings.before(begin);
    if (options_.fit_only) return std::move(report_);
    find_causes();
    search_.polish(block_s_);
    progress(0.85);
    findings.conclude(search_.about(block_s_), candidates_of_end());
    const auto& log = fit_.log();
    word_verdict(report_, log.roles(), across_axes(log.robot(), log.setup(), log.roles()));
    progress(1.0);
    return std::move(report_);
  }

  /// The search alone, about pictures that were linearised already.
  Look look() {
    report_.not_testable = untestable(fit_.log().roles(), motion());
    find_causes();
    if (!asked_) field();
    Findings(fit_, search_, options_, report_).name_causes(asked_->log, asked_->candidates);
    word_verdict(report_, fit_.log().roles());
    return {std::move(report_), search_.best(asked_->base)};
  }

 private:
  /// Where fewer causes say the same the search goes on, and what is shown does not go back.
  void progress(double share) {
    shown_ = std::max(shown_, share);
    if (options_.progress) options_.progress(shown_);
  }

  [[nodiscard]] std::vector<JointSample> exposures() const {
    std::vector<JointSample> joints;
    for (const auto& picture : fit_.log().pictures()) joints.push_back(picture.joints);
    return joints;
  }

  [[nodiscard]] LogMotion motion() const {
    std::vector<bool> seen(fit_.log().rig().cameras.size(), false);
    for (const auto& picture : fit_.log().pictures()) seen[picture.camera] = true;
    const auto& log = fit_.log();
    return log_motion(exposures(), static_cast<std::size_t>(std::count(seen.begin(), seen.end(), true)), log.encoders(),
                      log.robot(), log.setup(), log.roles());
  }

  void refuse_unusable() const {
    const auto length = log_length(exposures(), fit_.log().roles(), options_);
    if (const auto why = why_too_short(length, report_.not_testable, fit_.log().roles(), options_); !why.empty())
      throw DataError(why);
  }

  /// All candidates about the present model, scored, in blocks long enough that neighbours do not err alike.
  struct Field {
    LogAbout log;
    BlockRegression base;
    std::vector<Candidate> candidates;  ///< the catalogue's, free curves, of each joint the best slip
    double threshold = 0.0;
  };
  Field& field() {
    LogAbout log = search_.about(block_s_);
    BlockRegression base = search_.regression(log);
    auto candidates = catalogue_candidates(fit_, log, report_.not_testable);
    std::vector<Scores> scores;
    if (search_.refits()) add_curves(log, candidates);
    for (auto& candidate : candidates) {
      candidate.scores = base.score(candidate.columns);
      scores.push_back(candidate.scores);
    }
    alike_ = neighbours_alike(scores);
    auto slips = diagnosis::slips(log, base, report_.not_testable, search_.refits());
    std::move(slips.all.begin(), slips.all.end(), std::back_inserter(scores));
    std::move(slips.best.begin(), slips.best.end(), std::back_inserter(candidates));
    add_stated(log, base, candidates);
    const double threshold = chance_threshold(scores, options_.level, options_.seed);
    // A look has no time for curves, but where something is about to be named that may only stand in for one.
    if (!search_.refits() &&
        std::any_of(candidates.begin(), candidates.end(), [&](const Candidate& c) { return c.z() >= threshold; })) {
      const auto known = candidates.size();
      add_curves(log, candidates);
      for (std::size_t c = known; c < candidates.size(); ++c) candidates[c].scores = base.score(candidates[c].columns);
    }
    asked_.reset();
    return asked_.emplace(Field{std::move(log), std::move(base), std::move(candidates), threshold});
  }

  /// Slips that others saw happen, where they stand out for themselves.
  void add_stated(const LogAbout& log, const BlockRegression& base, std::vector<Candidate>& candidates) {
    if (changes_.empty()) return;
    auto slips = stated_slips(log, base, changes_);
    if (stated_count_ == 0) stated_count_ = slips.size();
    for (auto& slip : slips) {
      if (slip.z() < threshold_of(true)) continue;
      std::erase_if(candidates, [&](const Candidate& c) { return c.cause == slip.cause; });
      candidates.push_back(std::move(slip));
    }
  }

  /// What a candidate's z must reach: that of all of them, but for what others saw happen.
  [[nodiscard]] double threshold_of(bool stated) const {
    return stated ? normal_quantile(options_.level / static_cast<double>(stated_count_)) : report_.z_threshold;
  }

  void add_curves(const LogAbout& log, std::vector<Candidate>& candidates) {
    auto curves = free_curves(fit_, log);
    std::move(curves.begin(), curves.end(), std::back_inserter(candidates));
  }

  /// As one takes causes in one after the other, the first may stand in for what is found later: where fewer say the
  /// same there is room for others.
  void find_causes() {
    block_s_ = options_.block_s;
    do {
      take_all();
      while (drop_one()) asked_.reset();
    } while (search_.refits() && say_simpler());
  }

  void take_all() {
    for (std::size_t round = 0; round < limits::kMostRounds; ++round) {
      const bool full = search_.causes().size() >= limits::kMostCauses;
      const bool taken = !full && take_one();
      progress(0.2 + 0.6 * static_cast<double>(round + 1) / static_cast<double>(limits::kMostRounds));
      // One that others have made needless since makes room for the next.
      if (taken || (full && drop_one())) {
        asked_.reset();
        continue;
      }
      // Blocks that err alike are no witnesses of their own.
      if (alike_ <= limits::kNeighboursAlike || search_.about(2.0 * block_s_).blocks < limits::kFewestBlocks) break;
      block_s_ *= 2.0;
      asked_.reset();
    }
  }

  /// @return whether fewer causes, or simpler ones, took the place of some
  bool say_simpler() {
    bool any = false;
    while (say_one_simpler() || say_two_as_one()) {
      any = true;
      while (drop_one()) asked_.reset();
    }
    return any;
  }

  /// A cause that was taken while others were still missing may say more than the log asks for in the end: a simpler
  /// one of the same joint that is a part of it takes its place where nothing of the rest stands out any more. A joint
  /// moved along its link is a longer link.
  bool say_one_simpler() {
    for (std::size_t c = 0; c < search_.causes().size(); ++c) {
      const FoundCause& found = search_.causes()[c];
      if (found.generic() || found.columns < 2 || found.name.joint.empty()) continue;
      if (std::find(said_simply_.begin(), said_simply_.end(), found.name) != said_simply_.end()) continue;
      said_simply_.push_back(found.name);  // tried once
      if (replace_by_part(c)) return true;
    }
    return false;
  }

  /// @return whether a simpler cause took its place; otherwise all is as it was
  bool replace_by_part(std::size_t cause) {
    const CauseName name = search_.causes()[cause].name;
    spdlog::debug("diagnosis: tries a part of {}", name.text());
    auto before = search_.now();
    search_.drop({cause});
    asked_.reset();
    if (const auto simpler = part_of(name); simpler && take_instead(*simpler, {name}, before.cost)) {
      spdlog::debug("diagnosis: {} says what {} said", simpler->text(), name.text());
      return true;
    }
    search_.go_back_to(std::move(before));
    asked_.reset();
    return false;
  }

  /// Of the candidates the best one of the same joint that can say nothing that this one cannot.
  std::optional<CauseName> part_of(const CauseName& name) {
    const Field& field = this->field();
    const auto whole = std::find_if(field.candidates.begin(), field.candidates.end(),
                                    [&](const Candidate& c) { return c.cause == name; });
    if (whole == field.candidates.end()) return std::nullopt;
    const Candidate* best = nullptr;
    for (const auto& part : field.candidates) {
      if (part.generic() || part.cause.joint != name.joint || part.parameters.size() >= whole->parameters.size()) {
        continue;
      }
      if (part.z() < threshold_of(part.stated) || (best != nullptr && part.z() <= best->z())) continue;
      if (is_part(field, part, *whole)) best = &part;
    }
    return best == nullptr ? std::nullopt : std::optional(best->cause);
  }

  /// @param cost  with those that it replaces
  /// @return whether it explains as much, and nothing of those stands out beside it
  bool take_instead(const CauseName& simpler, const std::vector<CauseName>& of, double cost) {
    const auto named = [](const Field& field, const CauseName& name) {
      return std::find_if(field.candidates.begin(), field.candidates.end(),
                          [&](const Candidate& c) { return c.cause == name; });
    };
    const double cost_without = search_.cost();
    const Field& without = asked_ ? *asked_ : field();
    const auto candidate = named(without, simpler);
    if (candidate == without.candidates.end()) return false;
    Trial trial{&*candidate, without.base.heldout(candidate->columns), 0.0, true};
    trial.gain = without.base.heldout().total() - trial.heldout.total();
    auto model = with(without, trial);
    if (!model) return false;
    const auto explains_as_much = [&](double own, double share) { return own - cost <= share * (cost_without - cost); };
    // Once the noise is measured again it may fit a little better.
    if (!explains_as_much(model->cost, 2.0 * limits::kAlikeShare)) return false;
    search_.take(std::move(*model));
    if (!explains_as_much(search_.cost(), limits::kAlikeShare)) return false;
    const Field& left = field();
    return std::none_of(of.begin(), of.end(), [&](const CauseName& name) {
      const auto rest = named(left, name);
      return rest != left.candidates.end() && rest->z() >= threshold_of(rest->stated);
    });
  }

  /// Two causes that were found one after the other may say together what a single one says: all parts larger and the
  /// forearm smaller by as much are a larger hand. That one takes their place where neither stands out beside it.
  bool say_two_as_one() {
    const auto& causes = search_.causes();
    for (std::size_t b = 1; b < causes.size(); ++b) {
      for (std::size_t a = 0; a < b; ++a) {
        if (causes[a].generic() || causes[b].generic()) continue;
        const std::pair both(causes[a].name, causes[b].name);
        if (std::find(said_as_one_.begin(), said_as_one_.end(), both) != said_as_one_.end()) continue;
        said_as_one_.push_back(both);  // tried once
        if (const auto one = one_for(a, b); one && replace_by_one(a, b, *one)) return true;
      }
    }
    return false;
  }

  /// The cause of fewer parameters that explains most of what these two do, about the present model; none: none
  /// explains enough of it.
  std::optional<CauseName> one_for(std::size_t a, std::size_t b) {
    const Field& field = this->field();
    auto out = search_.columns_of(a);
    const auto more = search_.columns_of(b);
    out.insert(out.end(), more.begin(), more.end());
    const auto reduced = diagnosis::without(search_, field.base, out);
    const auto explained = [](const Scores& s) { return s.total.dot(s.S.ldlt().solve(s.total)); };
    const double both = explained(reduced.base.score(reduced.own));
    std::optional<CauseName> best;
    double most = limits::kRivalShare * both;
    for (const auto& candidate : field.candidates) {
      if (candidate.generic() || candidate.parameters.size() >= out.size()) continue;
      const auto scores = reduced.base.score(beside(candidate.columns, reduced));
      if (scores.independent.maxCoeff() < limits::kRounding) continue;
      if (const double share = explained(scores); share > most) {
        most = share;
        best = candidate.cause;
      }
    }
    return best;
  }

  /// @return whether it took their place; otherwise all is as it was
  bool replace_by_one(std::size_t a, std::size_t b, const CauseName& one) {
    const std::vector<CauseName> two = {search_.causes()[a].name, search_.causes()[b].name};
    spdlog::debug("diagnosis: tries {} instead of {} and {}", one.text(), two[0].text(), two[1].text());
    auto before = search_.now();
    search_.drop({a, b});
    asked_.reset();
    if (take_instead(one, two, before.cost)) {
      spdlog::debug("diagnosis: {} says what {} and {} said", one.text(), two[0].text(), two[1].text());
      return true;
    }
    search_.go_back_to(std::move(before));
    asked_.reset();
    return false;
  }

  /// Finds the next cause and takes it into the model; false: there is none.
  bool take_one() {
    const Field& field = this->field();
    report_.z_threshold = field.threshold;
    const bool first = std::exchange(nothing_asked_, false);
    if (first) leave_out_untold(field);
    auto trials = trials_of(field, first);
    for (std::size_t tried = 0; !trials.empty() && tried < limits::kMostTried; ++tried) {
      const Trial* best = choose(field, trials);
      if (best->candidate->generic() && take_known_instead(field, trials, *best)) return true;
      auto model = with(field, *best);
      if (model && best->candidate->z() >= threshold_of(best->candidate->stated)) {
        best = fits_better(field, trials, *best, *model);
      }
      const auto cause = best->candidate->cause;
      spdlog::debug("diagnosis: {} {}, z {:.1f} (chance: {:.1f}), held-out gain {:.0f}", cause.text(),
                    best->candidate->variable, best->candidate->z(), field.threshold, best->gain);
      if (model) {
        auto before = search_.now();
        search_.take(std::move(*model));
        // What is large bends the very sums by which it is judged: so it is judged where it is fitted.
        const double z = z_of_last(), threshold = threshold_of(best->candidate->stated);
        spdlog::debug("diagnosis: fitted, cost {:.4f}, z {:.1f}", search_.cost(), z);
        if (best->candidate->z() >= threshold || z >= threshold) return true;
        search_.go_back_to(std::move(before));
      }
      if (!best->candidate->generic()) refused_.push_back(cause);
      std::erase_if(trials, [&](const Trial& t) { return &t == best || t.candidate->cause == cause; });
    }
    return false;
  }

  double z_of_last() {
    const auto all = search_.regression(search_.about(block_s_));
    const auto reduced = diagnosis::without(search_, all, search_.columns_of(search_.causes().size() - 1));
    return reduced.base.score(reduced.own).z();
  }

  struct Trial {
    const Candidate* candidate;
    Heldout heldout;
    double gain;
    bool plausible;
  };

  /// Candidates that may be there, those first that predict best what their fit has not seen. What would be larger than
  /// on any robot comes last: it stands in for something else, if anything plausible does as well.
  std::vector<Trial> trials_of(const Field& field, bool first) {
    std::optional<double> without;  // most logs have nothing to try
    std::vector<Trial> trials;
    for (const auto& candidate : field.candidates) {
      const double z = candidate.z();
      if (first) add_bar(candidate, z);
      // One that is fitted anew may stand out then.
      const bool may_grow = search_.refits() && !candidate.generic();
      if (z < (may_grow ? limits::kWorthATrial_z : threshold_of(candidate.stated))) continue;
      if (candidate.scores.independent.maxCoeff() < limits::kRounding) continue;
      if (std::find(refused_.begin(), refused_.end(), candidate.cause) != refused_.end()) continue;
      if (!without) without = field.base.heldout().total();
      Trial trial{&candidate, field.base.heldout(candidate.columns), 0.0, true};
      trial.gain = *without - trial.heldout.total();
      trial.plausible = is_plausible(field.log, candidate, trial.heldout.estimate.tail(candidate.columns.size()));
      if (trial.gain > 0.0 && !says_hardly_more(candidate, trial.gain)) trials.push_back(std::move(trial));
    }
    std::sort(trials.begin(), trials.end(), [](const Trial& a, const Trial& b) { return a.gain > b.gain; });
    std::stable_partition(trials.begin(), trials.end(), [](const Trial& t) { return t.plausible; });
    return trials;
  }

  /// A free curve stands in for a known cause of its joint where, with that one fitted, nothing of the curve stands out
  /// any more: sums about a model that is far off may rank what is bent, or happens at some time, below the curve.
  bool take_known_instead(const Field& field, const std::vector<Trial>& trials, const Trial& curve) {
    if (!search_.refits()) return false;
    const auto& joint = curve.candidate->cause.joint;
    std::size_t tried = 0;
    for (const auto& trial : trials) {
      const auto& known = *trial.candidate;
      if (known.generic() || known.cause.joint != joint) continue;
      if (tried++ == limits::kMostTried) break;
      auto model = with(field, trial);
      if (!model) continue;
      auto before = search_.now();
      search_.take(std::move(*model));
      spdlog::debug("diagnosis: {} instead of a curve: cost {:.4f}", known.cause.text(), search_.cost());
      if (!stands_out(*curve.candidate)) return true;
      search_.go_back_to(std::move(before));
    }
    return false;
  }

  /// Whether this curve does, about the present model.
  bool stands_out(const Candidate& curve) {
    const LogAbout log = search_.about(block_s_);
    const BlockRegression base = search_.regression(log);
    for (auto& candidate : free_curves(fit_, log)) {
      if (candidate.cause.joint != curve.cause.joint || candidate.variable != curve.variable) continue;
      candidate.scores = base.score(candidate.columns);
      return candidate.z() >= threshold_of(false);
    }
    return false;
  }

  /// Whether it is what was found already under another name, and a little besides: a longer link that seems to lie
  /// aside. A look has no fits that would show whether that little is there.
  [[nodiscard]] bool says_hardly_more(const Candidate& candidate, double gain) const {
    if (search_.refits() || candidate.columns.size() < 2) return false;
    const Eigen::VectorXd unit = candidate.scores.S.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
    const Eigen::MatrixXd S = unit.asDiagonal() * candidate.scores.S * unit.asDiagonal();
    const bool one_is_known = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(S).eigenvalues()[0] < limits::kSameChange;
    return one_is_known && std::any_of(search_.causes().begin(), search_.causes().end(), [&](const FoundCause& found) {
             return found.name.joint == candidate.cause.joint && found.columns < candidate.parameters.size() &&
                    gain < limits::kAlikeShare * found.gain;
           });
  }

  [[nodiscard]] double room_of(const LogAbout& log, const Candidate& candidate) const {
    if (candidate.generic()) return 1.0;
    const auto effect =
        make_effect(candidate.cause.name, {candidate.cause.joint, candidate.cause.source}, fit_.log().roles());
    double room = 1.0;
    for (const auto& p : std::as_const(*effect).parameters()) {
      if (p.fitted) room = std::max(room, largest_plausible(log, *effect, p) / (limits::kImplausible * p.typical));
    }
    return room;
  }

  [[nodiscard]] bool is_plausible(const LogAbout& log, const Candidate& candidate,
                                  const Eigen::VectorXd& estimate) const {
    if (candidate.generic()) return true;
    const auto effect =
        make_effect(candidate.cause.name, {candidate.cause.joint, candidate.cause.source}, fit_.log().roles());
    Eigen::Index i = 0;
    for (const auto& p : std::as_const(*effect).parameters()) {
      if (p.fitted && std::abs(estimate[i++]) > largest_plausible(log, *effect, p)) return false;
    }
    return true;
  }

  /// The best known cause, or a free curve where that explains much more than any known one. Of causes that explain
  /// alike the simplest; a joint moved along its link is a longer link, and what it lies aside besides is asked for
  /// next.
  const Trial* choose(const Field& field, const std::vector<Trial>& trials) {
    const auto known =
        std::find_if(trials.begin(), trials.end(), [](const Trial& t) { return !t.candidate->generic(); });
    const auto generic =
        std::find_if(trials.begin(), trials.end(), [](const Trial& t) { return t.candidate->generic(); });
    if (known == trials.end()) return &*generic;
    if (generic != trials.end() && generic->gain > limits::kGenericGain * known->gain) return &*generic;
    const double dof = static_cast<double>(known->heldout.loss.size()) - 1.0;
    const Trial* best = &*known;
    for (const auto& trial : trials) {
      const bool simpler =
          !trial.candidate->generic() && trial.candidate->parameters.size() < best->candidate->parameters.size();
      if (!simpler || trial.gain < (1.0 - limits::kAlikeShare) * known->gain) continue;
      const bool worse = paired_t(trial.heldout.loss, known->heldout.loss) >= student_quantile(limits::kRivalTail, dof);
      if (!worse || is_part(field, *trial.candidate, *known->candidate)) best = &trial;
    }
    return best;
  }

  /// Whether all that one cause can say another one, of more parameters, can say too.
  bool is_part(const Field& field, const Candidate& part, const Candidate& whole) {
    auto both = directions_of(fit_, field.log, whole);
    const auto more = directions_of(fit_, field.log, part);
    for (std::size_t p = 0; p < both.size(); ++p) both[p].insert(both[p].end(), more[p].begin(), more[p].end());
    const auto S = field.base.score(added_columns(field.log, both)).S;
    const auto n = whole.columns.size(), own = part.columns.size();
    const Eigen::MatrixXd cross = S.bottomLeftCorner(own, n);
    const Eigen::MatrixXd left =
        S.bottomRightCorner(own, own) - cross * S.topLeftCorner(n, n).ldlt().solve(cross.transpose());
    return left.diagonal().cwiseQuotient(S.diagonal().tail(own)).maxCoeff() < limits::kSameChange;
  }

  std::optional<ModelSearch::Extended> with(const Field& field, const Trial& trial) {
    const auto& candidate = *trial.candidate;
    FoundCause cause{.name = candidate.cause, .variable = candidate.variable, .from = candidate.from};
    cause.stated = candidate.stated;
    cause.gain = trial.gain;
    const auto [begin, end] = seen_span(fit_, field.log.at);
    cause.begin_s = begin;
    cause.duration_s = end - begin;
    cause.amounts = candidate.amounts;
    cause.columns = static_cast<std::size_t>(candidate.columns.size());
    cause.room = room_of(field.log, candidate);
    return search_.with(cause, trial.heldout.estimate, field.base.size());
  }

  /// Sums about a model that is far off rank causes poorly: those as simple as the best that seem to explain much of
  /// the same are fitted too, and one that then leaves clearly less is taken.
  /// @param model  the model with `best`; afterwards with the one that is returned
  const Trial* fits_better(const Field& field, const std::vector<Trial>& trials, const Trial& best,
                           ModelSearch::Extended& model) {
    if (!search_.refits() || best.candidate->generic()) return &best;
    const Trial* better = &best;
    std::size_t tried = 1;
    for (const auto& trial : trials) {
      const auto& rival = *trial.candidate;
      if (&trial == &best || rival.generic() || trial.plausible != best.plausible) continue;
      if (rival.parameters.size() > best.candidate->parameters.size()) continue;
      if (trial.gain < limits::kRivalShare * best.gain || tried++ == limits::kMostTried) break;
      auto other = with(field, trial);
      const double explained = search_.cost() - model.cost;
      if (!other || search_.cost() - other->cost < (1.0 + limits::kAlikeShare) * explained) continue;
      model = std::move(*other);
      better = &trial;
    }
    return better;
  }

  /// Takes out the cause that the log needs least, where it does not need it any more.
  bool drop_one() {
    if (search_.causes().empty()) return false;
    std::optional<BlockRegression> anew;
    if (!asked_) anew = search_.regression(search_.about(block_s_));
    const BlockRegression& all = asked_ ? asked_->base : *anew;
    const double with = all.heldout().total();
    std::size_t worst = 0;
    double least = 1e300;
    for (std::size_t c = 0; c < search_.causes().size(); ++c) {
      const auto reduced = without(search_, all, search_.columns_of(c));
      const double t = reduced.base.score(reduced.own).z();
      const double gain = reduced.base.heldout().total() - with;
      const double strength = gain > 0.0 ? t / threshold_of(search_.causes()[c].stated) : 0.0;
      if (strength >= least) continue;
      least = strength;
      worst = c;
    }
    if (least >= 1.0) return false;
    refused_.push_back(search_.causes()[worst].name);
    search_.drop({worst});
    return true;
  }

  std::vector<Candidate> candidates_of_end() {
    Field& field = this->field();
    for (const auto& candidate : field.candidates) {
      for (auto& bar : report_.bars) {
        if (bar.label == label_of(candidate)) bar.z_after = std::max(bar.z_after, candidate.z());
      }
    }
    // A model that holds as many causes as it may, and is asked for more, has some that stand in for others.
    if (search_.causes().size() >= limits::kMostCauses) {
      const auto trials = trials_of(field, false);
      report_.more_asked = std::any_of(trials.begin(), trials.end(), [&](const Trial& trial) {
        return trial.candidate->z() >= threshold_of(trial.candidate->stated);
      });
    }
    return std::move(field.candidates);
  }

  static std::string label_of(const Candidate& candidate) {
    return candidate.generic() ? candidate.cause.joint + " against its " + candidate.variable : candidate.cause.text();
  }

  void add_bar(const Candidate& candidate, double t) {
    const auto label = label_of(candidate);
    for (auto& bar : report_.bars) {
      if (bar.label != label) continue;
      bar.z_before = std::max(bar.z_before, t);
      return;
    }
    report_.bars.push_back({.label = label, .generic = candidate.generic(), .z_before = t});
  }

  /// What offsets and nuisances make up for in this log, and what so few blocks would show only if it were larger than
  /// on any robot.
  void leave_out_untold(const Field& field) {
    for (const auto& candidate : field.candidates) {
      if (candidate.generic()) continue;
      if (candidate.scores.independent.maxCoeff() < limits::kRounding) {
        report_.not_testable.push_back(
            {candidate.cause, "joint offsets and usual nuisances make up for it in this log"});
        continue;
      }
      const bool told = is_told(field.log, candidate, field.threshold);
      if (!told)
        report_.not_testable.push_back(
            {candidate.cause, fmt::format("not testable with {} postures", field.log.blocks)});
    }
  }

  LogFit& fit_;
  const DiagnosisOptions& options_;
  ModelSearch search_;
  std::vector<Microseconds> changes_;  ///< seen by others
  std::size_t stated_count_ = 0;       ///< of slips then, at first
  DiagnosisReport report_;
  double block_s_ = 0.0;
  double shown_ = 0.0;  ///< of the progress
  bool nothing_asked_ = true;
  std::optional<Field> asked_;  ///< about the present model
  double alike_ = 0.0;          ///< correlation of neighbouring blocks, at the last look
  std::vector<CauseName> refused_;
  std::vector<CauseName> said_simply_;                        ///< of more parameters, looked at once whether fewer do
  std::vector<std::pair<CauseName, CauseName>> said_as_one_;  ///< looked at once whether one cause does
};

}  // namespace
}  // namespace diagnosis

DiagnosisReport diagnose(LogFit& fit, const std::vector<Belief>& beliefs, const std::vector<Belief>& tolerances,
                         const DiagnosisOptions& options) {
  return diagnosis::Diagnoser(fit, diagnosis::ModelSearch(fit, beliefs, tolerances, options), options).run();
}

diagnosis::Look diagnosis::look(LogFit& fit, State state, std::shared_ptr<const LinearLog> pictures,
                                std::vector<OutlineNoise> noise, const std::vector<Belief>& tolerances,
                                const DiagnosisOptions& options, const std::vector<Microseconds>& changes) {
  ModelSearch search(fit, std::move(state), std::move(pictures), std::move(noise), tolerances, options);
  return Diagnoser(fit, std::move(search), options, changes).look();
}

}  // namespace bodyschema
