#include "explanations.hpp"

#include <algorithm>

#include "limits.hpp"

namespace bodyschema {

std::optional<Explanation> explain(const std::vector<Hypothesis>& hypotheses, const PostureMemory& known,
                                   const OutlineFit& held, double time_s, const Frame& frame, OutlineFitter& fitter) {
  std::optional<Explanation> best;
  double least = held.misfit - limits::kClearlyBetter;
  for (const auto& hypothesis : hypotheses) {
    PostureMemory memory = hypothesis.instead != nullptr ? *hypothesis.instead : known;
    const bool anew = hypothesis.released.size() == static_cast<std::size_t>(known.layout().estimated());
    if (anew) {
      memory.forget_all();
    } else if (!hypothesis.released.empty()) {
      memory.release(hypothesis.released, time_s);
    }
    OutlineFit fit = hypothesis.starts.empty()       ? fitter.follow(frame, memory)
                     : hypothesis.starts.size() == 1 ? fitter.follow_from(frame, hypothesis.starts.front(), memory)
                                                     : fitter.search(frame, hypothesis.starts, memory);
    // An arm that is somewhere else altogether shows so in its whole silhouette, not only in how an outline runs.
    if (anew && !fitter.clearly_nearer(fit, held)) continue;
    // Something may hide the robot: no change explains that which leaves as much of it hidden.
    if (!hypothesis.by_silhouette &&
        fit.seen.evidence.odd_share() > limits::kLeastExplained * held.seen.evidence.odd_share() + limits::kFewOdd) {
      continue;
    }
    const double cost = fit.misfit + limits::kPerParameter * static_cast<double>(hypothesis.released.size());
    const bool silhouettes_say_so = hypothesis.by_silhouette && !fitter.fits(held.evidence);
    if (!silhouettes_say_so && (!fitter.fits(fit.evidence) || cost >= least)) continue;
    least = cost;
    best = Explanation{hypothesis, std::move(memory), std::move(fit), cost};
  }
  return best;
}

}  // namespace bodyschema
