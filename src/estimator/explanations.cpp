#include "explanations.hpp"

#include <utility>

#include "limits.hpp"

namespace bodyschema {
namespace {

bool is_anew(const Hypothesis& hypothesis, const PostureMemory& known) {
  return hypothesis.released.size() == static_cast<std::size_t>(known.layout().estimated());
}

/// What is known where it is true.
PostureMemory known_under(const Hypothesis& hypothesis, const PostureMemory& known, double time_s) {
  PostureMemory memory = hypothesis.instead != nullptr ? *hypothesis.instead : known;
  if (is_anew(hypothesis, known)) {
    memory.forget_all();
  } else if (!hypothesis.released.empty()) {
    for (const auto k : hypothesis.released) memory.loosen_since(k, hypothesis.doubted_since_s);
    memory.release(hypothesis.released, time_s);
  }
  return memory;
}

/// Whether a hypothesis explains a picture, and better than the memory does by more than `least`.
/// @param gain  by how much: chi-square, what free parameters cost counted in
bool explains(const Hypothesis& hypothesis, bool anew, const Frame& frame, const OutlineFit& fit,
              const OutlineFit& held, double least, OutlineFitter& fitter, double& gain) {
  // An arm that is somewhere else altogether shows so in its whole silhouette, not only in how an outline runs.
  const bool shown = anew && fitter.only_first_shown(frame, fit, held);
  if (anew && !shown && (fitter.only_first_shown(frame, held, fit) || !fitter.clearly_nearer(fit, held))) return false;
  // Something may hide the robot: no change explains that which leaves as much of it hidden.
  if (!hypothesis.by_silhouette &&
      fit.seen.evidence.odd_share() > limits::kLeastExplained * held.seen.evidence.odd_share() + limits::kFewOdd) {
    return false;
  }
  const double freed = static_cast<double>(hypothesis.released.size());
  const double bound = static_cast<double>(hypothesis.known_instead);
  gain = held.misfit - fit.misfit - limits::kPerParameter * (freed - bound);
  const bool silhouettes_say_so = hypothesis.by_silhouette && (shown || !fitter.fits(frame, held.evidence));
  return silhouettes_say_so || (fitter.fits(frame, fit.evidence) && gain > least);
}

}  // namespace

bool go_on(ExplanationRound& round, const PostureMemory& known, const OutlineFit& held, const Frame& frame,
           OutlineFitter& fitter, int room) {
  bool best_is_of_frame = false;
  for (; round.at < round.hypotheses.size(); ++round.at, round.search = {}) {
    const Hypothesis& hypothesis = round.hypotheses[round.at];
    PostureMemory memory = known_under(hypothesis, known, frame.time_s);
    OutlineFit fit;
    if (hypothesis.starts.size() > 1) {
      if (round.search.starts.empty()) round.search.starts = hypothesis.starts;
      round.search.by_pictures = is_anew(hypothesis, known);
      if (!fitter.go_on(frame, memory, round.search, room)) return false;
      fit = fitter.found(frame, memory, round.search);
    } else if (!hypothesis.starts.empty()) {
      if (!fitter.may_follow(room)) return false;
      fit = fitter.follow_from(frame, hypothesis.starts.front(), memory);
    } else {
      fit = fitter.follow(frame, memory, memory.estimate().x);
    }
    double gain = 0.0;
    const double least = round.best ? round.gain : limits::kClearlyBetter;
    if (!explains(hypothesis, is_anew(hypothesis, known), frame, fit, held, least, fitter, gain)) continue;
    round.gain = gain;
    round.best = Explanation{hypothesis, std::move(memory), std::move(fit)};
    best_is_of_frame = true;
  }
  if (!round.best || best_is_of_frame) return true;
  Explanation& best = *round.best;
  best.memory = known_under(best.hypothesis, known, frame.time_s);
  best.fit = best.hypothesis.starts.empty() ? fitter.follow(frame, best.memory, best.memory.estimate().x)
                                            : fitter.follow_from(frame, best.fit.x, best.memory);
  double gain = 0.0;
  if (!explains(best.hypothesis, is_anew(best.hypothesis, known), frame, best.fit, held, limits::kClearlyBetter, fitter,
                gain)) {
    round.best.reset();
  }
  return true;
}

}  // namespace bodyschema
