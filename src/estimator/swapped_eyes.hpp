#pragma once

#include <Eigen/Core>
#include <optional>

#include "bodyschema/evidence/posture_memory.hpp"
#include "eye_order.hpp"
#include "outline_fitter.hpp"
#include "particle_search.hpp"

namespace bodyschema {

/// Whether the left picture shows what the right eye sees and the other way round. What is asked about must be the
/// frame that `scorer` has; it has it again afterwards. One thread.
class SwappedEyes {
 public:
  SwappedEyes(HypothesisScorer& scorer, OutlineFitter& fitter, ParticleSearch& particles, double min_mask_share)
      : scorer_(scorer), fitter_(fitter), particles_(particles), min_mask_share_(min_mask_share) {}

  /// Where the arm is known: whether that explains the pictures once they are exchanged, and only then.
  bool turned(const Frame& frame, const Eigen::VectorXd& known);
  /// Before it is known whose pictures these are: by how near the arm can be brought to them from the first guesses.
  /// Searched for on as many frames as that takes; meanwhile as it was last found, or nothing.
  std::optional<bool> from_the_start(const Frame& frame, const PostureMemory& memory);
  /// Whether a search has begun and is not through.
  [[nodiscard]] bool searching() const { return search_.has_value(); }

 private:
  bool go_on(const Frame& shown, const PostureMemory& memory, StartSearch& search);

  struct Search {
    StartSearch as_they_are, exchanged;
  };
  HypothesisScorer& scorer_;
  OutlineFitter& fitter_;
  ParticleSearch& particles_;
  double min_mask_share_;
  EyeOrder order_;
  std::optional<Search> search_;  ///< goes on with the next frame
  std::optional<bool> found_;     ///< by the last search
};

}  // namespace bodyschema
