#pragma once

#include <functional>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bodyschema/bus/bus_options.hpp"
#include "bodyschema/bus/observation_stream.hpp"
#include "bodyschema/camera/stereo_rig.hpp"
#include "bodyschema/core/background_worker.hpp"
#include "bodyschema/core/configuration.hpp"
#include "bodyschema/effects/error_model.hpp"
#include "bodyschema/estimator/estimator.hpp"
#include "bodyschema/pipeline/background_watch.hpp"
#include "bodyschema/pipeline/frozen_picture.hpp"
#include "bodyschema/pipeline/looks_file.hpp"
#include "bodyschema/robot/robot_model.hpp"
#include "bodyschema/robot/robot_setup.hpp"
#include "bodyschema/vision/given_mask.hpp"
#include "bodyschema/vision/segmenter.hpp"

namespace bodyschema {

/// At which size pictures are read.
enum class PictureReading {
  kAsSent,
  kAsNeeded,  ///< reduced where they have more pixels than are needed (picture_reduction), as a service does
};

/// From configuration to estimates: robot, cameras, segmentation and estimator wired together.
/// The daemon, replay and evaluation run this same object, so that a recorded log gives what the
/// live robot gave. Called by one thread, beside which it has one of its own.
class Pipeline {
 public:
  /// Reads the whole configuration, robot and meshes, opens the silhouette engine. Throws Error.
  /// @param method  instead of the configured one, where that proved to be of no use
  /// @param reading  as needed: not in mode paper, nor where pictures are compared as they are with what others made
  ///   (masks, a background picture) or have hard edges, nor with `vision.picture_size: as_sent`
  explicit Pipeline(const Configuration& configuration, std::optional<SegmentationMethod> method = std::nullopt,
                    PictureReading reading = PictureReading::kAsSent);

  /// A fresh decoder and synchroniser for this robot and rig.
  [[nodiscard]] ObservationStream make_stream() const;

  using OnEstimate = std::function<void(const Estimate&)>;
  /// Fills in the observation's masks and takes one step of the estimator: segment(), estimate().
  /// @param next  the observation that will come next, where it has come already; null: unknown. Its
  ///   masks are found by another thread while the estimator is at work, which changes no result. It
  ///   is only read, and until this returns; std::logic_error when another one comes after all. No
  ///   effect where masks need estimates, which go by the estimate before.
  /// @param on_estimate  gets the estimate as soon as it is there: before what the pictures teach of background and
  ///   looks is learned, for the next ones
  Estimate process(Observation& observation, const Observation* next = nullptr, const OnEstimate& on_estimate = {});
  /// Straightens the pictures and fills in the masks. A camera that repeats its last picture while
  /// the arm moves gets none: it is frozen; nor does one whose mask did not come (`vision.method: given`). False while
  /// the background is being learned.
  bool segment(Observation& observation);
  /// One step of the estimator on an observation that has its masks.
  Estimate estimate(const Observation& observation);

  /// Takes over the background that the pipeline this one replaces has learned, where cameras and
  /// vision settings are the same: a hand in view would be learned as background now. Of a background that is
  /// given, the picture read last counts. `other` segments no more afterwards.
  void take_background_from(Pipeline& other);

  /// `vision.method: auto`: the robot's colours by camera, as learned so far; those known from an earlier run.
  [[nodiscard]] LooksByCamera looks() const;
  void know_looks(const LooksByCamera& looks);

  /// Offline learning of the background, for methods that learn: every picture of a log, then
  /// `finish_learning`.
  void learn_from(const Observation& observation);
  void finish_learning();
  /// Whether masks are looked for near where the robot is estimated to be (`vision.method: auto`, `statistics`).
  [[nodiscard]] bool masks_need_estimates() const {
    return vision_.method == SegmentationMethod::kAuto || vision_.method == SegmentationMethod::kStatistics;
  }
  /// Whether a background is learned from pictures, offline from all of a log (`auto`, `learned_background`).
  [[nodiscard]] bool learns_background() const {
    return vision_.method == SegmentationMethod::kAuto || needs_background();
  }
  /// Whether no mask is to be had before a background was learned (`learned_background`).
  [[nodiscard]] bool needs_background() const { return vision_.method == SegmentationMethod::kLearnedBackground; }

  [[nodiscard]] const RobotModel& robot() const { return *robot_; }
  [[nodiscard]] std::shared_ptr<const RobotModel> shared_robot() const { return robot_; }
  [[nodiscard]] const RobotSetup& setup() const { return setup_; }
  /// The cameras of the pictures as they are read, with the extended model's intrinsics, where there is one.
  [[nodiscard]] const StereoRig& rig() const { return rig_; }
  /// The cameras as configured.
  [[nodiscard]] const StereoRig& configured_rig() const { return sent_; }
  /// The extended model (robot.extended_model), if any.
  [[nodiscard]] const std::optional<ErrorModel>& error_model() const { return error_model_; }
  /// What of it is not in the rig, and not found anew as joints' offsets are.
  [[nodiscard]] ErrorModel known_effects() const;
  [[nodiscard]] const VisionSetup& vision() const { return vision_; }
  [[nodiscard]] const BusOptions& bus() const { return bus_; }
  [[nodiscard]] const EstimatorOptions& options() const { return options_; }
  [[nodiscard]] const Beliefs& beliefs() const { return beliefs_; }
  [[nodiscard]] Estimator& estimator() { return estimator_; }
  /// Whether a camera repeats its picture, as of the last observation that had one of it.
  [[nodiscard]] const PictureChange& picture(std::size_t camera) const { return changes_[camera]; }
  /// How far a camera has turned from where its background was learned, where the background changed with
  /// it; 0: it did not. As of the last observation that had a picture of it.
  [[nodiscard]] double background_turned_rad(std::size_t camera) const { return background_turned_rad_[camera]; }
  /// The same over all observations so far.
  [[nodiscard]] const BackgroundTurn& background_turn() const { return background_watch_.total(); }
  /// Time that the last `process` or `segment` spent on masks before it could estimate, ms.
  [[nodiscard]] double segmentation_ms() const { return segmentation_ms_; }
  [[nodiscard]] const std::string& configuration_hash() const { return configuration_hash_; }
  /// A short hexadecimal digest of the URDF file, of the meshes in use and of the extended model.
  [[nodiscard]] const std::string& model_hash() const { return model_hash_; }

 private:
  struct Eye {
    Segmenter segmenter;
    GivenMask given;
    std::optional<Undistorter> undistorter;
    BinaryMask seen;  ///< by the lens, in a straightened picture; empty: all of it
    FrozenPicture picture{};
  };
  /// What was found in one camera's picture.
  struct Look {
    PictureChange change;
    std::optional<Image> straightened;  ///< absent: the picture was straight
    BinaryMask mask, valid;
    std::vector<std::uint8_t> coverage;
    std::optional<BinaryMask> predicted;  ///< where the robot was looked for
    bool learning = false;
    /// What the lens never saw is neither robot nor background.
    void leave_out_all_but(const BinaryMask& seen);
  };
  /// One per camera; absent where the camera saw nothing.
  struct Looks {
    Microseconds utime = 0;
    std::vector<std::optional<Look>> of;
  };
  /// What one camera's picture is to be learned from with.
  struct Lesson {
    bool given = false;
    std::optional<BinaryMask> silhouette;  ///< where the robot was foreseen
    bool trusted = false;                  ///< that was, with reason
  };
  [[nodiscard]] static bool frozen(const PictureChange& change);
  /// @param alone  whether the other thread is free to help
  Looks look(const Observation& observation, bool alone);
  Look look_with(std::size_t camera, const CameraObservation& seen, std::optional<BinaryMask> predicted);
  [[nodiscard]] PredictedRobot prediction(std::size_t camera, const std::optional<BinaryMask>& silhouette) const;
  [[nodiscard]] double reach_px(std::size_t camera) const;
  template <class OfCamera>
  void for_each_eye(const OfCamera& of_camera, bool alone);
  void find_masks(Observation& observation);
  void learn_from_masks(const Observation& observation, bool alone);
  Looks looks_at(const Observation& observation);
  void watch_background(const Observation& observation, std::size_t camera, bool learning);

  RobotSetup setup_;
  VisionSetup vision_;
  BusOptions bus_;
  EstimatorOptions options_;
  StereoRig sent_;  ///< the cameras as configured
  std::shared_ptr<const RobotModel> robot_;
  std::optional<ErrorModel> error_model_;
  StereoRig rig_;
  Beliefs beliefs_;
  std::vector<Eye> eyes_;  ///< those of the other thread while it looks ahead
  std::vector<PictureChange> changes_;
  std::vector<double> readouts_s_;  ///< of each camera, as configured
  BackgroundWatch background_watch_;
  std::vector<double> background_turned_rad_;
  Estimator estimator_;
  std::string configuration_hash_;
  std::string model_hash_;
  bool learning_ = false;
  std::vector<Lesson> lessons_;  ///< one per camera, of the last observation, until learned
  bool tracking_ = false;        ///< the estimate is good enough to predict where the robot is
  /// How far off the last estimate may have put outlines, px of a 320x240 picture; negative: nobody knows.
  double outline_sd_px_ = -1.0;
  bool young_ = true;  ///< few postures were seen: the estimate may be a wrong one's
  double segmentation_ms_ = 0.0;
  std::future<Looks> ahead_;  ///< at the next observation, where it was known
  /// Looks ahead, or at the second camera's picture.
  std::unique_ptr<BackgroundWorker> worker_ = std::make_unique<BackgroundWorker>();
};

}  // namespace bodyschema
