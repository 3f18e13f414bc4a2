#pragma once

#include <memory>
#include <span>
#include <vector>

#include "bodyschema/effects/instant.hpp"

namespace bodyschema {

/// The encoder samples about the exposures, beside a running robot or a log: shows them to effects with memory in order
/// of time, and finds the arm's motion at an exposure.
///
/// Exposures come in order of time, later than the samples around them. Velocity and acceleration come from the samples
/// (joint_motion), whatever was published. Not thread-safe; allocates nothing once warm.
class EncoderTrack {
 public:
  EncoderTrack(std::shared_ptr<const RobotModel> robot, const RobotSetup& setup);

  /// Samples in order of time; one with the stamp of the last replaces it (head and arm apart, with one stamp).
  void add(std::span<const JointSample> samples);
  void forget();

  /// Calls `see` with every sample up to `utime` that has not been shown yet.
  template <class See>
  void advance(Microseconds utime, See&& see) {
    for (; shown_ < samples_.size() && samples_[shown_].utime <= utime; ++shown_) see(samples_[shown_]);
  }
  /// What effects may look at in an exposure. `offsets`, subtracted from the encoders, say where the arm stands and
  /// gravity acts: radians, RobotModel order.
  void instant(const JointSample& exposure, std::size_t camera, const Eigen::Ref<const Eigen::VectorXd>& offsets,
               Instant& out);
  /// The torques alone, anew, of an arm that stands elsewhere.
  void torques_at(const JointSample& exposure, const Eigen::Ref<const Eigen::VectorXd>& offsets, Instant& out);

 private:
  InstantBuilder instants_;
  std::vector<JointSample> samples_;  ///< in order of time; the first `shown_` have been shown
  std::size_t shown_ = 0;
  Instant elsewhere_;
};

}  // namespace bodyschema
