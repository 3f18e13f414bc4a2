#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "bodyschema/core/background_worker.hpp"
#include "bodyschema/effects/encoder_track.hpp"
#include "bodyschema/estimator/exposure.hpp"
#include "bodyschema/evidence/log_fit.hpp"
#include "bodyschema/evidence/state.hpp"
#include "bodyschema/outline/effect_probes.hpp"
#include "bodyschema/outline/outline_measurement.hpp"
#include "stamp_noise.hpp"

namespace bodyschema {

/// What the pictures of one frame say about a state near some value of it.
struct FrameEvidence {
  std::vector<StateEvidence> cameras;   ///< about the value; px^2 of a 320x240 picture, not divided by a variance
  std::vector<TimeEvidence> time;       ///< ... and of when each was taken; where wanted
  double sampled = 0.0, matched = 0.0;  ///< outline points of all cameras
  double square = 0.0, weight = 0.0;    ///< of residuals, as OutlineEvidence
  std::vector<double> cost;             ///< per camera: robust cost of the whole outline
  double odd = 0.0;                     ///< outline points left out, as OutlineEvidence
  std::vector<std::vector<OutlineSample>> samples;  ///< per camera: of the last look; where wanted
  [[nodiscard]] double rms_px() const { return weight > 0.0 ? std::sqrt(square / weight) : 0.0; }
  [[nodiscard]] double matched_share() const { return sampled > 0.0 ? matched / sampled : 0.0; }
  [[nodiscard]] double odd_share() const { return sampled > 0.0 ? odd / sampled : 0.0; }
};

/// The pictures of one frame with what is known of their exposures: all that is needed to look at them again.
struct Frame {
  double time_s = 0.0;                         ///< by its stamp; goes on where the stamps' clock stepped back
  std::vector<Exposure> exposures;             ///< per camera; where one saw nothing, another's
  std::vector<const CameraObservation*> seen;  ///< per camera; null: nothing. Not owned
  std::vector<BinaryMask> covered;             ///< per camera: where a held thing may be; empty: nowhere
  bool shown = false;                          ///< pictures showed the robot's outline where their masks are kept alone
  [[nodiscard]] bool exposed() const;          ///< whether any camera saw anything
};

/// What a state predicts, and what pictures say of it: plays the encoders through the state's effects, turns their
/// parameters into corrections of each exposure, and asks the outlines.
///
/// A state is a vector x, one value per parameter of State. Besides there are effects that are not estimated
/// (`beside`): their values stay zero, but what they would change is asked for. One thread.
class FrameModel {
 public:
  /// @param drawn  meshes that outlines are taken from; null: the robot's own
  FrameModel(std::shared_ptr<const RobotModel> robot, const RobotSetup& setup, const StereoRig& rig,
             const JointRoles& roles, State state, const ErrorModel& beside, const SilhouetteModel* drawn = nullptr);

  /// Shows the next observation's encoder samples to the effects. The observation must live as long as its frame.
  /// @param x  the state believed in, under which gravity acts on the arm
  Frame take(const Observation& observation, const Eigen::VectorXd& x);
  void forget();

  [[nodiscard]] const State& state() const { return state_; }
  [[nodiscard]] const JointRoles& roles() const { return roles_; }
  [[nodiscard]] std::size_t part_count() const { return measurement_.part_count(); }
  /// Which parts no joint of arm or head moves against the cameras: the base before a camera that stands still.
  [[nodiscard]] const std::vector<bool>& still_parts() const { return still_parts_; }
  [[nodiscard]] Eigen::Index beside_count() const { return static_cast<Eigen::Index>(beside_.parameters().size()); }
  [[nodiscard]] double picture_unit_px(std::size_t camera) const {
    return picture_unit(rig_.cameras[camera].intrinsics);
  }
  /// An exposure that has not been taken: its motion as far as it is known so far.
  [[nodiscard]] Exposure preview(const JointSample& joints, std::size_t camera);
  /// One of an arm at rest, known by its encoders alone.
  [[nodiscard]] Exposure at_rest(const Eigen::VectorXd& q, std::size_t camera);

  void corrections(const Exposure& exposure, const Eigen::VectorXd& x, Corrections& out);
  /// Transforms of the parts in a camera of a frame. Entries of x beyond the joint offsets are taken from the last
  /// `settle`: what many hypotheses about offsets are drawn with.
  void settle(const Frame& frame, const Eigen::VectorXd& x);
  void place(const Eigen::VectorXd& x, std::size_t camera, std::span<Eigen::Isometry3f> X_CB);

  /// Evidence of every camera with a mask about the state near x and, where wanted, about what lies beside it and when
  /// the picture was taken.
  /// @param search  one per camera
  /// @param look  called with a camera's matched points
  void linearise(const Frame& frame, const Eigen::VectorXd& x, std::span<const OutlineSearch> search, bool with_beside,
                 FrameEvidence& out, const std::function<void(std::size_t, std::span<const OutlinePoint>)>& look = {});

  [[nodiscard]] Pose hand_pose(const Exposure& exposure, const Eigen::VectorXd& x);
  [[nodiscard]] Pose nominal_hand_pose(const Exposure& exposure);
  /// How the hand's place in the camera moves: 3 x (state, beside), m per SI unit.
  [[nodiscard]] Eigen::MatrixXd hand_jacobian(const Exposure& exposure, const Eigen::VectorXd& x);
  /// Places the robot; RobotProjection then holds it.
  RobotProjection& project(const Exposure& exposure, const Eigen::VectorXd& x);
  RobotProjection& project_nominal(const Exposure& exposure);

 private:
  /// What one camera is asked, and answers.
  struct Question {
    std::vector<std::uint32_t> active;  ///< coordinates that parameters move
    Eigen::MatrixXd J;                  ///< what the parameters do to these
    Eigen::VectorXd by_time;            ///< ... and a second; empty: not asked
    Corrections corrections;
    OutlineEvidence answer;
    bool asked = false;
  };
  void find_directions(const Exposure& exposure, const Eigen::VectorXd& x, bool with_beside, Question& out);
  [[nodiscard]] OutlineMeasurement& measurement_of(std::size_t camera) {
    return camera == 0 ? measurement_ : more_measurements_[camera - 1];
  }
  /// Asks all cameras at once, each with a thread of its own.
  void ask(const Frame& frame, std::span<const OutlineSearch> search);
  void expose(const JointSample& joints, std::size_t camera, const Eigen::VectorXd& x, Exposure& out);
  void find_still_parts(const Eigen::VectorXd& q);

  JointRoles roles_;
  StereoRig rig_;
  State state_;
  bool sags_ = false;       ///< some effect follows gravity
  bool remembers_ = false;  ///< some effect has a memory
  OutlineMeasurement measurement_;
  std::vector<OutlineMeasurement> more_measurements_;  ///< of further cameras
  std::unique_ptr<BackgroundWorker> worker_;           ///< asks the second camera; null: there is one
  std::vector<bool> still_parts_;
  double last_s_ = 0.0, behind_s_ = 0.0;  ///< time of the last frame; how far stamps have stepped back since the first
  EncoderTrack track_;
  EffectProbes probes_, beside_, time_;
  const Frame* settled_frame_ = nullptr;
  std::vector<Corrections> settled_;  ///< per camera, of the state without joint offsets
  Corrections scratch_;
  const Corrections nothing_;
  std::vector<Direction> directions_, more_directions_;
  std::vector<Eigen::Index> position_;  ///< of a coordinate among the active; -1: it is none
  std::vector<Question> questions_;     ///< per camera
};

}  // namespace bodyschema
