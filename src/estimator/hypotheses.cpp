#include "hypotheses.hpp"

#include <numeric>

#include "limits.hpp"

namespace bodyschema {
namespace {

/// A joint slipped: from where the outline's slopes point to, or where silhouettes say.
Hypothesis slip(Eigen::Index joint, const FusedState& known, const OutlineFit& fit, bool near,
                const ParticleSearch& particles) {
  Hypothesis result{"", {joint}, {}};
  result.doubted_since_s = known.stalled.standing_since_s(joint);
  Eigen::VectorXd start = known.where_it_was();
  double step = known.memory.step(fit.quadratic, result.released).size[0];
  // Outlines further off than they are looked for say nothing: then the silhouettes do.
  const auto slipped_rad = near ? std::nullopt : particles.slipped_offset_rad(joint);
  if (slipped_rad) step = *slipped_rad - start[joint];
  start[joint] += step;
  result.starts = {start};
  return result;
}

std::vector<Eigen::Index> camera_parameters(const State& state) {
  std::vector<Eigen::Index> list;
  for (Eigen::Index k = state.joints(); k < state.size(); ++k) {
    const auto& effect = state.model()[state.parameters()[static_cast<std::size_t>(k)].ref.effect];
    if (effect.name() == "camera_pose" || effect.name() == "head_offset") list.push_back(k);
  }
  return list;
}

}  // namespace

std::vector<Hypothesis> hypotheses(const FusedState& known, const State& state, const OutlineFit& fit,
                                   const FrameOutcome& outcome, const Frame& frame, ParticleSearch& particles) {
  constexpr std::size_t kStarts = 3;
  std::vector<Hypothesis> list;
  auto anew = particles.nearest(known.x, kStarts);
  if (known.hand_is_lost() || (known.young() && outcome.verdict != FrameVerdict::kAgrees)) {
    // What the first pictures were taken for has drawn the particles to itself, and may have been wrong.
    const auto guesses = particles.nearest_guesses(particles.score_first_guesses(frame), kStarts);
    anew.insert(anew.end(), guesses.begin(), guesses.end());
  }
  std::vector<Eigen::Index> everything(static_cast<std::size_t>(state.size()));
  std::iota(everything.begin(), everything.end(), Eigen::Index{0});
  if (!known.young()) {
    for (Eigen::Index joint = 0; joint < state.joints(); ++joint) {
      list.push_back(slip(joint, known, fit, outcome.near, particles));
    }
    if (const auto camera = camera_parameters(state); !camera.empty()) {
      // From afar: knocked by more than is looked for about a memory.
      list.push_back({"the cameras were moved", camera, {known.where_it_was()}});
    }
  }
  if (known.alternative && frame.time_s - known.alternative_s < limits::kAlternative_s && !known.stalled.suspected()) {
    list.push_back({"what was known before holds", {}, {}, &*known.alternative});
    // One picture that is wrong may look like an arm elsewhere; the next ones are as the better memory foresees.
    if (known.young()) list.back().known_instead = everything.size();
  }
  list.push_back(
      {"the arm was found elsewhere", everything, anew, nullptr, known.young() || known.hand_was_never_seen()});
  return list;
}

}  // namespace bodyschema
