#pragma once

#include <memory>

#include "bodyschema/camera/stereo_rig.hpp"
#include "bodyschema/effects/error_model.hpp"
#include "bodyschema/estimator/estimate.hpp"
#include "bodyschema/estimator/estimator_options.hpp"
#include "bodyschema/estimator/exposure.hpp"
#include "bodyschema/observation/observation.hpp"
#include "bodyschema/robot/robot_model.hpp"
#include "bodyschema/robot/robot_setup.hpp"

namespace bodyschema {

/// One observation in, one estimate out: the same object behind the daemon, the replay of a log
/// and the evaluation.
///
/// Both modes predict, score all particles' silhouettes and estimate. `paper` ends there, literal
/// to the paper. `best` moves the most likely particles onto the observed outline by Gauss-Newton,
/// and fuses what each posture says about the offsets and what else is estimated.
///
/// Deterministic: the same observations, options and seed give the same estimates, bit for bit,
/// for any number of threads. One thread at a time. `step` does not throw.
class Estimator {
 public:
  /// @param beliefs  what is estimated, and what may be wrong besides
  /// @param known  what is known to be wrong with the model already: the robot's extended model; its joint offsets are
  ///   not used
  /// Throws ConfigurationError when set-up and robot do not fit, gl::ContextError when the engine
  /// cannot be had.
  Estimator(std::shared_ptr<const RobotModel> robot, const RobotSetup& setup, const StereoRig& rig,
            const Beliefs& beliefs, const EstimatorOptions& options);
  Estimator(std::shared_ptr<const RobotModel> robot, const RobotSetup& setup, const StereoRig& rig,
            const Beliefs& beliefs, const EstimatorOptions& options, const ErrorModel& known);
  ~Estimator();
  Estimator(Estimator&&) noexcept;

  /// Masks must have been filled in; a camera that is absent is not used.
  Estimate step(const Observation& observation);

  /// Likelihood 1 - d (equation 4) of joint offsets, one hypothesis per column, all else nominal.
  /// Zero where the hand is not in view. Leaves the estimate as it is; exposure() is of this observation afterwards.
  [[nodiscard]] Eigen::VectorXd likelihood(const Observation& observation, const Eigen::MatrixXd& offsets_rad);

  /// A camera's exposure of the observation seen last; where it saw nothing, another's.
  [[nodiscard]] const Exposure& exposure(std::size_t camera) const;
  /// An exposure known by its encoder readings alone: an arm at rest.
  [[nodiscard]] Exposure at_rest(const Eigen::VectorXd& q, std::size_t camera) const;
  /// Outline of the robot predicted for an observation, for overlays and masks.
  /// @param corrected  with the current estimate, otherwise with the encoders and the model as they are
  [[nodiscard]] BinaryMask predicted_silhouette(const Observation& observation, std::size_t camera, bool corrected);
  /// The same with an earlier estimate of this estimator.
  [[nodiscard]] BinaryMask predicted_silhouette(const Observation& observation, std::size_t camera,
                                                const Estimate& estimate);
  /// Where the model puts the hand in the exposure's camera; `corrected` and `estimate` as above.
  [[nodiscard]] Pose hand_pose(const Exposure& exposure, bool corrected);
  [[nodiscard]] Pose hand_pose(const Exposure& exposure, const Estimate& estimate);
  /// Covariance of the last estimate's hand base in a camera, m^2; Estimate::hand_sd_m is the root of its trace.
  [[nodiscard]] Eigen::Matrix3d hand_covariance_m2(const Exposure& exposure);
  [[nodiscard]] std::string engine_description() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace bodyschema
