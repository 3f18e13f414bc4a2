#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "bodyschema/core/time.hpp"
#include "bodyschema/estimator/weakest_direction.hpp"
#include "bodyschema/geometry/pose.hpp"

namespace bodyschema {

/// What the estimator is doing; `to_string` gives the name used in messages and files.
enum class EstimatorState {
  kLearningBackground,  ///< no masks yet: the background is being learned
  kHandNotInView,       ///< the observed silhouette is empty: no update, the last offsets are kept
  kConverging,          ///< updating, not yet to be relied on
  /// Several distinct postures agree within what is claimed, and the hand is known as well as asked for. In mode paper:
  /// the spread is at its smallest, no more.
  kConverged,
  kDiverged,     ///< the best prediction no longer fits the pictures; searching again
  kModelMisfit,  ///< postures agree only if something is wrong by more than is believed possible: see `misfit`
  /// What is seen of the robot agrees with what is known, but too much of the hand is hidden to claim `converged`: the
  /// offsets are kept.
  kOccluded,
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

/// One parameter of an effect that is estimated beside the joints' offsets.
struct EstimatedParameter {
  std::string effect;         ///< "link_length"
  std::string joint, source;  ///< its target
  std::string parameter;      ///< "change"
  std::string name;           ///< of all of these: "link_length of r_elbow", "camera_pose turn_x"
  std::string unit;           ///< what people read: "mm", "deg", "%"
  double si_per_unit = 1.0;   ///< value in SI = value in unit * si_per_unit
  double value = 0.0;         ///< SI
  double sd = 0.0;            ///< SI
  double prior_sd = 0.0;      ///< SI, what was believed of it before any picture
  /// Whether the pictures tell it: its standard deviation is below a third of what was believed before.
  [[nodiscard]] bool told() const { return sd < prior_sd / 3.0; }
};

/// Something outside the state that recent pictures ask for.
struct Finding {
  std::string effect;         ///< of the catalogue; "unexplained": something follows `source` that no effect explains
  std::string joint, source;  ///< its target
  std::string sentence;       ///< "pictures arrive 58 ms (57 to 59) late against the encoders"
  struct Parameter {
    std::string name, unit;
    double value = 0.0, sd = 0.0;  ///< in `unit`
  };
  std::vector<Parameter> parameters;
  double z = 0.0;                    ///< by how many standard deviations blocks of pictures agree that it is there
  double hand_mm = 0.0;              ///< what it moves, root mean square: the hand, the joints' offsets fitted anew ...
  double outline_px = 0.0;           ///< ... and the outlines
  std::vector<std::string> alike{};  ///< what these pictures cannot tell from it: "backlash of r_elbow"
  Microseconds from = 0;             ///< of a slip: when it happened
  bool estimated = false;            ///< the state holds it: it is taken into account
  /// "latency 58 ms", "slip of r_elbow -4.9 deg, or drift of r_elbow".
  [[nodiscard]] std::string text() const;
};

/// What was found beside the state, as of the last look at it; a look every few seconds.
struct LiveFindings {
  Microseconds utime = 0;    ///< of the newest picture that was looked at; 0: none yet
  double span_s = 0.0;       ///< of the pictures
  std::size_t blocks = 0;    ///< in which they are compared
  double z_threshold = 0.0;  ///< that chance alone does not reach
  std::vector<Finding> causes;
};

/// What the pictures say about the memory of earlier ones.
enum class FrameVerdict {
  kNothingKnown,  ///< there is no memory to compare with
  kAgrees,
  kDoubtful,     ///< not learned from; a single bad frame, or the beginning of something
  kContradicts,  ///< the memory does not explain it
};
const char* to_string(FrameVerdict verdict);

/// What other things hide of the robot in one frame: shares of the predicted outline, 0 to 1, that show the edge of
/// something else or lie where a held thing is known to be. They are left out of the evidence.
struct HiddenShare {
  double hand = 0.0;         ///< of hand and fingers, all cameras; 0 where none of them is in view
  double hand_missed = 0.0;  ///< ... of what no held thing is known to cover; 0 where given masks show robot there
  double robot = 0.0;        ///< of all that is drawn of the robot
  bool holds = false;        ///< something is known to be held: it has moved with the hand over several postures
  /// "35 % of the hand is hidden, it holds something"; empty: nothing worth a word.
  [[nodiscard]] std::string text() const;
};

/// Result of one step. Offsets follow the paper's sign: encoder = true + offset.
struct Estimate {
  Microseconds utime = 0;
  EstimatorState state = EstimatorState::kHandNotInView;
  std::vector<std::string> joint_names;  ///< the estimated joints
  Eigen::VectorXd offset_rad;            ///< one per name
  Eigen::MatrixXd covariance_rad2;
  Eigen::VectorXd prior_sd_rad;             ///< of each joint's offset before any picture
  std::vector<EstimatedParameter> effects;  ///< what else is estimated
  double effective_sample_size = 0.0;       ///< particles, 0 when not computed from this frame
  double best_likelihood = 0.0;             ///< 1 - Hammoude distance of the estimate, all images; 0 when not in view
  double contour_rms_px = 0.0;              ///< outline residual, px of a 320x240 picture; 0: not from this frame
  WeakestDirection weakest;
  double hand_sd_m = 0.0;        ///< hand base in the camera frame: root of the summed variances of x, y, z
  double hand_sd_limit_m = 0.0;  ///< `converged` needs it smaller; 0: not in this mode
  FrameVerdict verdict = FrameVerdict::kNothingKnown;
  double innovation = 0.0;           ///< normalised innovation squared of this frame against the memory
  double innovation_dof = 0.0;       ///< and its expectation, were all as believed
  double innovation_usual = 1.0;     ///< mean of innovation / dof of late
  std::size_t postures = 0;          ///< distinct ones that the offsets rest on
  double posture_sd_rad = 0.0;       ///< what a posture gets wrong, as an angle of each joint; learned
  double head_posture_sd_rad = 0.0;  ///< the same of each joint that carries the cameras
  double stamp_sd_s = 0.0;           ///< how far pictures' stamps err from one to the next; learned
  double outline_sd_px = 0.0;        ///< of one residual of the outlines, measured; px of a 320x240 picture
  double outline_alike = 0.0;        ///< how many neighbouring outline points err as one; measured
  std::string changed;               ///< what was taken to have changed in this frame: "r_elbow slipped by 4.9 deg"
  std::string misfit;                ///< in kModelMisfit: what is wrong by more than believed possible, and what to do
  std::string stalled_joint;         ///< its encoder stands although the pictures show it move;
                                     ///< empty: none. The state is never kConverged then
  double stalled_motion_rad = 0.0;   ///< how far it has been seen to move
  bool cameras_swapped = false;      ///< the left picture shows what the right eye sees and the other way
                                     ///< round; nothing is learned from them, state kDiverged. Mode best
  std::vector<Pose> X_CP;            ///< hand base in each camera of the rig, corrected; in one that is absent for the
                                     ///< encoders of another
  std::vector<Pose> X_CP_nominal;    ///< the same with encoders and model as they are
  HiddenShare hidden;                ///< mode best
  LiveFindings findings;             ///< by LiveDiagnosis, where one watches
  StageTimes times;

  /// Whether the pictures tell a joint's offset: its standard deviation is below 0.5 deg and below a third of what was
  /// believed before. In kModelMisfit none is told: deviations rest on a model that the pictures contradict.
  [[nodiscard]] bool told(std::size_t joint) const;
};

}  // namespace bodyschema
