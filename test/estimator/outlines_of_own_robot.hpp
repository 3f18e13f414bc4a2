#pragma once

#include "bodyschema/evidence/batch_fit.hpp"
#include "outline_fitter.hpp"
#include "particles_of_own_robot.hpp"

namespace bodyschema {

/// What fits outlines in frames of a reach, and an empty memory about the same state.
class OutlinesOfOwnRobot : public ParticlesOfOwnRobot {
 protected:
  OutlinesOfOwnRobot()
      : fitter_(*model_, *scorer_, options_, rig_.cameras.size(), kAllRenders), memory_(layout(), {}) {}

  [[nodiscard]] MemoryLayout layout() const {
    const Eigen::VectorXd sd = model_->state().prior_sd();
    return {model_->state().prior_mean(), sd, std::vector<bool>(static_cast<std::size_t>(sd.size()), true), {}};
  }
  /// The reach at a point of its way; the observation lives as long as the next one.
  Frame at(double s) {
    time_us_ += 1'000'000;
    seen_ = reach_.observe(pose(s), time_us_);
    Frame frame = model_->take(seen_, truth_);
    scorer_->observe(frame, options_.min_mask_share);
    return frame;
  }
  [[nodiscard]] Eigen::VectorXd posture(const Frame& frame) const {
    return posture_of(frame.exposures[0].at.encoder, model_->roles());
  }

  static constexpr int kAllRenders = 1000;
  OutlineFitter fitter_;
  PostureMemory memory_;
  const Eigen::VectorXd truth_ = paper_offsets_rad();
  Microseconds time_us_ = 0;
};

}  // namespace bodyschema
