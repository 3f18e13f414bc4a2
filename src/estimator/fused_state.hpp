#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <vector>

#include "bodyschema/evidence/posture_memory.hpp"
#include "frame_model.hpp"
#include "stalled_encoders.hpp"

namespace bodyschema {

/// The robot as it is known from frame to frame: what postures taught of its state, fused, and where joints were last
/// that may be anywhere. One thread.
struct FusedState {
  /// @param least_postures  of fewer it is not to be relied on
  FusedState(const State& state, MemoryLayout layout, const MemoryOptions& options, std::size_t least_postures);

  /// Too few postures for what is remembered to be relied on.
  [[nodiscard]] bool young() const { return memory.postures() < least_postures; }
  /// Most of the hand's outline was not where it is believed to be, in most postures that were learned from and in most
  /// of the last ones: something may hide a hand now and then, but what is fitted to the smaller part of it time and
  /// again is some other outline.
  [[nodiscard]] bool hand_is_lost() const {
    return postures_ >= least_postures && 2 * postures_missed_ > postures_ && missed_lately_ > 0.5;
  }
  /// ... and so much of it that nothing is known of the hand: nothing is lost with what was learned of it.
  [[nodiscard]] bool hand_was_never_seen() const {
    return postures_ >= least_postures && 2 * postures_without_hand_ > postures_;
  }
  /// Not to be relied on, for one reason or the other.
  [[nodiscard]] bool unsure() const { return young() || hand_is_lost(); }
  /// What a posture that was learned from did not show of the hand: a share of its outline.
  void hand_was_missed(double share);
  void forget_missed() {
    postures_ = postures_missed_ = postures_without_hand_ = 0;
    missed_lately_ = 0.0;
  }
  /// Joints that may be anywhere, or of which nothing is known any more, where they were last; the rest fused.
  [[nodiscard]] Eigen::VectorXd where_it_was() const;
  /// What postures disagree by, times what is claimed of them: no estimate is better than the postures that it is made
  /// of.
  [[nodiscard]] double disagreement() const;

  void begin_frame() { resumed_now_.clear(); }
  /// The encoders of a frame: readings that stood while their joints may have moved are believed again where they move.
  void read(const Eigen::VectorXd& reading_rad, double time_s);
  /// Joints that may be anywhere are where this frame shows them.
  void see_loose_joints();
  /// Nothing that was learned holds.
  void forget();

  PostureMemory memory;
  StalledEncoders stalled;
  Eigen::VectorXd x;                           ///< fused over postures
  MemoryEstimate in_frame;                     ///< the same with the last frame's own error
  std::optional<PostureMemory> alternative{};  ///< the memory that the last change of mind cost ...
  double alternative_s = 0.0;                  ///< ... when it did
  std::size_t least_postures;

 private:
  void believe_again(const StalledEncoders::Resumed& resumed, double time_s);

  Eigen::VectorXd prior_mean_;
  Eigen::Index joints_;
  std::vector<Eigen::Index> resumed_now_;  ///< joints whose stall ended with this frame
  std::size_t postures_ = 0;               ///< that were learned from since something was forgotten ...
  std::size_t postures_missed_ = 0;        ///< ... and did not show most of the hand's outline
  std::size_t postures_without_hand_ = 0;  ///< ... or next to nothing of it
  double missed_lately_ = 0.0;             ///< share of the last ones that did not show most of it
};

}  // namespace bodyschema
