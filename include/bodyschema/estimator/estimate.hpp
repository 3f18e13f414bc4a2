#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "bodyschema/core/time.hpp"
#include "bodyschema/geometry/pose.hpp"
#include "bodyschema/estimator/weakest_direction.hpp"

namespace bodyschema {

/// What the estimator is doing; `to_string` gives the name used in messages and files.
enum class EstimatorState {
  kLearningBackground,  ///< no masks yet: the background is being learned
  kHandNotInView,       ///< the observed silhouette is empty: no update, the last offsets are kept
  kConverging,          ///< updating, not yet to be relied on
  kConverged,           ///< pictures fit, `hand_sd_m` is small; mode paper: the spread is at its smallest, no more
  kDiverged,            ///< the best prediction no longer fits the pictures; searching again
};
const char* to_string(EstimatorState state);

/// Time spent in each stage of one step, ms of wall clock.
struct StageTimes {
  double kinematics_ms = 0.0;
  double scoring_ms = 0.0;
  double filter_ms = 0.0;
  double refinement_ms = 0.0;
  double total_ms = 0.0;
};

/// Result of one step. Offsets follow the paper's sign: encoder = true + offset.
struct Estimate {
  Microseconds utime = 0;
  EstimatorState state = EstimatorState::kHandNotInView;
  std::vector<std::string> joint_names;  ///< the estimated joints
  Eigen::VectorXd offset_rad;            ///< one per name
  Eigen::MatrixXd covariance_rad2;
  std::vector<std::string> nuisance_names;  ///< head offsets, camera and size parameters, if any
  std::size_t head_joints = 0;              ///< so many of these, the first, are offsets of head joints
  std::vector<std::string> nuisance_units;  ///< "rad", "px" or "1" (relative), one per name
  Eigen::VectorXd nuisance;                 ///< in that unit
  Eigen::VectorXd nuisance_sd;              ///< in that unit
  double effective_sample_size = 0.0;       ///< particles, 0 when not computed from this frame
  double best_likelihood = 0.0;             ///< 1 - Hammoude distance of the estimate, both images; 0 when not in view
  double contour_rms_px = 0.0;              ///< outline residual, 0 when not computed from this frame
  WeakestDirection weakest;
  double hand_sd_m = 0.0;           ///< hand base in the eye frame: root of the summed variances of x, y, z
  std::string stalled_joint;        ///< its encoder stands although the pictures show it move;
                                    ///< empty: none. The state is never kConverged then
  double stalled_motion_rad = 0.0;  ///< how far it has been seen to move
  bool cameras_swapped = false;     ///< the left picture shows what the right eye sees and the other way
                                    ///< round; nothing is learned from them, state kDiverged. Mode best
  std::vector<Pose> X_CP;           ///< hand base in each camera of the rig, corrected. In one that is absent: for
                                    ///< the encoders of another, the camera where it was known to be when last
                                    ///< seen; never seen since the start or a reload, where its configuration has it
  std::vector<Pose> X_CP_nominal;   ///< the same with encoders and model as they are
  StageTimes times;
};

}  // namespace bodyschema
