#pragma once

#include <optional>
#include <string>
#include <vector>

#include "bodyschema/estimator/estimator_options.hpp"
#include "explanations.hpp"
#include "frame_outcome.hpp"
#include "fused_state.hpp"
#include "innovation_gate.hpp"
#include "keyframes.hpp"
#include "occlusion.hpp"
#include "outline_fitter.hpp"
#include "particle_search.hpp"
#include "swapped_eyes.hpp"

namespace bodyschema {

/// Mode best, stage by stage of a frame: measures its outline, holds that against what is known, searches for what may
/// have happened, and remembers. What is known lies in `known`; what the frame came to goes to an outcome. `scorer`
/// must have the frame. One thread.
class ArmTracker {
 public:
  ArmTracker(FrameModel& model, HypothesisScorer& scorer, ParticleSearch& particles, OutlineFitter& fitter,
             Occlusion& occlusion, FusedState& known, const EstimatorOptions& options);

  /// Marks in a frame what a held thing may cover, and lets searches look at pictures anew.
  void begin_frame(Frame& frame);
  /// The frame shows no robot.
  void lose_sight();
  /// Whether the frame's pictures are another eye's, or it is not known yet whose: nothing is learned from them then.
  bool shows_wrong_eyes(const Frame& frame, FrameOutcome& outcome);
  /// Encoders that stall, and what depends on how much is known.
  void read_encoders(const Frame& frame);

  /// Searches for an arm of which nothing is known, as far as the frame allows; one that is found becomes the memory.
  void find(const Frame& frame, FrameOutcome& outcome);
  /// The frame's outline, looked for where the arm was.
  OutlineFit measure(const Frame& frame);
  /// How that agrees with what is known.
  void gate(const Frame& frame, const OutlineFit& fit, FrameOutcome& outcome);
  /// Tries what may have happened where the frame contradicts what is known, or that is so young that it may be wrong.
  void explain(const Frame& frame, const OutlineFit& fit, FrameOutcome& outcome);
  /// Takes a frame that agrees into the memory.
  void remember(const Frame& frame, const OutlineFit& fit, FrameOutcome& outcome);
  /// Where the next frame's searches begin.
  void spread_particles(const FrameOutcome& outcome);

  /// How well the hand is known, as reported of the last frame.
  void hand_known_to(double sd_m) { hand_sd_m_ = sd_m; }
  [[nodiscard]] double usual() const { return gate_.usual(); }

 private:
  void learn(const Frame& frame, const OutlineFit& fit, FrameOutcome& outcome);
  void settle_on(const Frame& frame, const OutlineFit& fit, FrameOutcome& outcome);
  void doubt(const Eigen::VectorXd& x, FrameOutcome& outcome);
  bool take_for_hidden(const Frame& frame, const OutlineFit& fit, FrameOutcome& outcome);
  void take(const Frame& frame, Explanation better, FrameOutcome& outcome);
  void stay(const Frame& frame, const OutlineFit& fit, FrameOutcome& outcome);
  [[nodiscard]] bool strayed(const Eigen::VectorXd& x) const;
  void put_off_searches();
  void forget_everything();
  void forget_memory();

  FrameModel& model_;
  HypothesisScorer& scorer_;
  ParticleSearch& particles_;
  OutlineFitter& fitter_;
  Occlusion& occlusion_;
  FusedState& known_;
  const EstimatorOptions& options_;
  SwappedEyes eyes_;
  InnovationGate gate_;
  Keyframes keyframes_;
  std::optional<StartSearch> lost_;        ///< for an arm of which nothing is known; goes on with the next frame
  std::optional<ExplanationRound> round_;  ///< goes on with the next frame
  double round_since_s_ = 0.0;
  bool found_in_doubt_ = false;  ///< the state is what a search found last, and nothing was learned from it
  bool unexplained_ = false;     ///< the pictures before, by all that was tried
  double doubted_since_s_ = -1.0;
  double hand_sd_m_ = 1.0;  ///< before any frame: not at all
};

}  // namespace bodyschema
