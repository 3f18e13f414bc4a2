#pragma once

#include <memory>
#include <vector>

#include "bodyschema/effects/error_model.hpp"
#include "bodyschema/observation/encoder_follower.hpp"

namespace bodyschema {

/// An error model at work beside a robot or a log: it sees every encoder sample and says what is
/// known to differ from the model at an exposure.
///
/// Exposures come later than the encoder samples around them, so samples wait here until an exposure
/// passes them; at most `kMostWaiting`, then effects see the oldest anyway. Velocity and acceleration come
/// from these samples (joint_motion), as in the diagnosis, whatever was published. Effects that depend on
/// the arm's posture take it from the model's own joint offsets: those they were fitted with.
/// Neither `observe` nor `corrections` throws or allocates once warm. Not thread-safe.
class OnlineErrorModel final : public EncoderFollower {
 public:
  static constexpr std::size_t kMostWaiting = 1024;
  static constexpr std::size_t kKept = 256;  ///< a quarter of a second at 1 kHz

  OnlineErrorModel(std::shared_ptr<const RobotModel> robot, const RobotSetup& setup, ErrorModel model);

  /// Every encoder sample in order of time.
  void observe(const JointSample& sample) override;
  /// Everything but the joint offsets, which an estimator finds anew, and the cameras' intrinsics,
  /// which ErrorModel::corrected puts into the rig.
  void corrections(const JointSample& exposure, std::size_t camera, Corrections& out);
  void annotate(CameraObservation& seen, std::size_t camera) override;
  void forget() override;

 private:
  void show_until(Microseconds utime);
  void make_room();

  ErrorModel model_;
  Eigen::VectorXd offsets_;
  InstantBuilder instants_;
  bool has_memory_ = false;
  bool sags_ = false;  ///< some effect follows gravity
  Instant at_;
  Corrections whole_;
  Instant before_;  ///< the sag
  Eigen::VectorXd sag_;
  bool moves_ = false;  ///< some effect follows the motion
  /// In order of time: first those that the effects have seen (the last `kKept` of them stay, for the
  /// motion about an exposure), then those that wait. Slots beyond `count_` keep their memory.
  std::vector<JointSample> samples_;
  std::size_t seen_ = 0;
  std::size_t count_ = 0;
};

}  // namespace bodyschema
