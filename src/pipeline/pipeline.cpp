#include "bodyschema/pipeline/pipeline.hpp"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>

#include "bodyschema/camera/lens_knowledge.hpp"
#include "bodyschema/camera/picture_reduction.hpp"
#include "bodyschema/camera/shutter.hpp"
#include "bodyschema/core/logging.hpp"
#include "bodyschema/imports/joint_mapping.hpp"
#include "bodyschema/imports/yarp_import.hpp"
#include "bodyschema/geometry/pinhole.hpp"
#include "model_hash.hpp"

namespace bodyschema {
namespace {

std::optional<ErrorModel> load_error_model(const RobotSetup& setup, const std::shared_ptr<const RobotModel>& robot,
                                           const StereoRig& rig) {
  if (setup.extended_model.empty()) return std::nullopt;
  return ErrorModel::load(setup.extended_model, JointRoles::of(robot, setup, rig));
}

StereoRig corrected(const StereoRig& rig, const std::optional<ErrorModel>& model) {
  return model ? model->corrected(rig) : rig;
}

StereoRig as_read(StereoRig rig, PictureReading reading, const VisionSetup& vision, EstimatorMode mode) {
  const bool reduces = reading == PictureReading::kAsNeeded && vision.reduces_pictures &&
                       mode != EstimatorMode::kPaper && vision.edges != EdgeKind::kHard &&
                       vision.method != SegmentationMethod::kGiven &&
                       vision.method != SegmentationMethod::kBackgroundPicture;
  for (auto& camera : rig.cameras) {
    const int n = picture_reduction(camera.intrinsics.width, camera.intrinsics.height);
    if (reduces && n > 1) camera.intrinsics = reduced(camera.intrinsics, n);
  }
  return rig;
}

std::vector<double> readouts_of(const Configuration& cameras, const StereoRig& rig) {
  std::vector<double> readouts_s;
  for (const auto& camera : rig.cameras) readouts_s.push_back(readout_s(cameras.section(camera.name)).value_or(0.0));
  return readouts_s;
}

/// What of an extended model is not in the rig already, and not found anew; and what the configuration says of
/// shutters.
ErrorModel effects_beside(const std::optional<ErrorModel>& model, const std::shared_ptr<const RobotModel>& robot,
                          const RobotSetup& setup, const StereoRig& rig, const std::vector<double>& readouts_s) {
  ErrorModel rest(JointRoles::of(robot, setup, rig));
  for (std::size_t e = 0; model && e < model->size(); ++e) {
    const auto& effect = (*model)[e];
    if (effect_kind(effect.name()).home != EffectHome::kCameras && effect.name() != "joint_offset") {
      rest.add(effect.clone());
    }
  }
  if (model) rest.set_uncertainty(model->uncertainty());
  for (std::size_t c = 0; c < readouts_s.size(); ++c) {
    if (readouts_s[c] == 0.0) continue;
    const EffectTarget target{"", rig.cameras.size() > 1 ? rig.cameras[c].name : ""};
    Effect* known = rest.find("rolling_shutter", target);
    Effect& shutter = known != nullptr ? *known : rest.add("rolling_shutter", target);
    shutter.parameters()[0].value += readouts_s[c];
  }
  return rest;
}

VisionSetup by(std::optional<SegmentationMethod> method, VisionSetup vision) {
  if (method) vision.method = *method;
  return vision;
}

}  // namespace

Pipeline::Pipeline(const Configuration& configuration, std::optional<SegmentationMethod> method, PictureReading reading)
    : setup_(RobotSetup::from(configuration.section("robot"))),
      vision_(by(method, VisionSetup::from(configuration.section("vision")))),
      bus_(BusOptions::from(configuration.section("bus"))), options_(EstimatorOptions::from(configuration)),
      sent_(StereoRig::from(configuration.section("cameras"))), robot_(load_robot(setup_, sent_)),
      error_model_(load_error_model(setup_, robot_, sent_)),
      rig_(corrected(as_read(sent_, reading, vision_, options_.mode), error_model_)),
      beliefs_(Beliefs::from(configuration, JointRoles::of(robot_, setup_, rig_), rig_, options_)),
      readouts_s_(readouts_of(configuration.section("cameras"), rig_)), background_watch_(robot_, rig_.links()),
      background_turned_rad_(rig_.cameras.size(), 0.0),
      estimator_(robot_, setup_, rig_, beliefs_, options_,
                 effects_beside(error_model_, robot_, setup_, rig_, readouts_s_)),
      configuration_hash_(configuration.hash()), model_hash_(model_hash_of(setup_, *robot_, error_model_)) {
  // Not ours, but checked like the rest: a robot's file may say how recordings of it are imported.
  if (configuration.has("yarp_import")) YarpImportOptions::from(configuration.section("yarp_import"));
  if (configuration.has("import")) {
    const Configuration import = configuration.section("import");
    JointMapping::from(import).check_names(import, *robot_, sent_);
  }
  for (const auto& camera : rig_.cameras) {
    if (vision_.method == SegmentationMethod::kBackgroundPicture &&
        !vision_.background_pictures.contains(camera.name)) {
      configuration.section("vision").section("background_pictures").fail(camera.name, "a file for each camera");
    }
    if (lens_knowledge(configuration.section("cameras").section(camera.name)) == LensKnowledge::kUnknown) {
      warn_once(fmt::format(
          "camera '{}' has no distortion in the configuration: how its lens bends pictures (k1) is estimated beside "
          "the offsets, which takes longer and tells them less well; set cameras.{}.distortion, to zeros where "
          "pictures come straightened (bodyschema new-robot --rectified)",
          camera.name, camera.name));
    }
    std::optional<Undistorter> undistorter;
    if (camera.has_distortion()) undistorter.emplace(camera);
    Segmenter segmenter(vision_, camera.name, camera.intrinsics.width, camera.intrinsics.height,
                        undistorter ? &*undistorter : nullptr);
    BinaryMask seen = undistorter ? undistorter->valid() : BinaryMask();
    eyes_.push_back({std::move(segmenter), GivenMask(vision_), std::move(undistorter), std::move(seen)});
  }
  changes_.resize(eyes_.size());
}

ErrorModel Pipeline::known_effects() const {
  return effects_beside(error_model_, robot_, setup_, rig_, readouts_s_);
}

ObservationStream Pipeline::make_stream() const {
  BusOptions bus = bus_;
  bus.synchroniser.masks = vision_.method == SegmentationMethod::kGiven;
  ObservationStream stream(robot_, setup_, sent_, bus);
  for (std::size_t c = 0; c < eyes_.size(); ++c) stream.reduce(c, rig_.cameras[c].intrinsics.reduction);
  if (vision_.method == SegmentationMethod::kBackgroundPicture) {
    for (std::size_t c = 0; c < eyes_.size(); ++c) {
      stream.expect_channels(c, eyes_[c].segmenter.background().channels);
    }
  }
  return stream;
}

void Pipeline::take_background_from(Pipeline& other) {
  if (!(vision_ == other.vision_) || rig_.cameras.size() != other.rig_.cameras.size()) return;
  const bool given = vision_.method == SegmentationMethod::kBackgroundPicture;
  for (std::size_t c = 0; c < eyes_.size(); ++c) {
    const CameraModel& now = rig_.cameras[c];
    const CameraModel& before = other.rig_.cameras[c];
    if (now.name != before.name || now.link != before.link || !(now.intrinsics == before.intrinsics) ||
        now.distortion != before.distortion) {
      return;
    }
    // The file of the same name may hold another picture by now.
    if (given && eyes_[c].segmenter.background().mean != other.eyes_[c].segmenter.background().mean) return;
  }
  for (std::size_t c = 0; c < eyes_.size(); ++c) eyes_[c].segmenter = std::move(other.eyes_[c].segmenter);
  background_watch_.take_from(other.background_watch_);
}

LooksByCamera Pipeline::looks() const {
  LooksByCamera looks;
  for (std::size_t c = 0; c < eyes_.size(); ++c) {
    if (eyes_[c].segmenter.looks().known()) looks[rig_.cameras[c].name] = eyes_[c].segmenter.looks();
  }
  return looks;
}

void Pipeline::know_looks(const LooksByCamera& looks) {
  for (std::size_t c = 0; c < eyes_.size(); ++c) {
    const auto found = looks.find(rig_.cameras[c].name);
    if (found != looks.end()) eyes_[c].segmenter.know_looks(found->second);
  }
}

void Pipeline::learn_from(const Observation& observation) {
  for (std::size_t c = 0; c < eyes_.size(); ++c) {
    if (!observation.cameras[c]) continue;
    const Image& image = observation.cameras[c]->image;
    background_watch_.learned(c, observation.cameras[c]->joints.q);
    eyes_[c].segmenter.learn_from(eyes_[c].undistorter ? eyes_[c].undistorter->apply(image) : image);
  }
}

void Pipeline::finish_learning() {
  for (auto& eye : eyes_) eye.segmenter.finish_learning();
}

Estimate Pipeline::process(Observation& observation, const Observation* next, const OnEstimate& on_estimate) {
  find_masks(observation);
  const bool looks_ahead = next != nullptr && !masks_need_estimates();
  if (looks_ahead) {
    ahead_ = worker_->begin([this, next, &observation] {
      learn_from_masks(observation, false);
      return look(*next, false);
    });
  }
  struct Wait {
    const std::future<Looks>& ahead;
    ~Wait() {
      if (ahead.valid()) ahead.wait();
    }
  } const wait{ahead_};
  Estimate estimated = estimate(observation);
  if (on_estimate) on_estimate(estimated);
  if (!looks_ahead) learn_from_masks(observation, true);
  return estimated;
}

bool Pipeline::frozen(const PictureChange& change) {
  return change.repeated && change.moved_rad > kFrozenMotion_rad;
}

void Pipeline::Look::leave_out_all_but(const BinaryMask& seen) {
  valid &= seen;
  mask &= seen;
  std::size_t i = 0;
  for (int v = 0; v < seen.height(); ++v) {
    for (int u = 0; u < seen.width(); ++u, ++i) {
      if (!seen.at(u, v)) coverage[i] = 0;
    }
  }
}

/// Each camera by itself: the other thread takes the second's share where it has nothing else to do.
template <class OfCamera>
void Pipeline::for_each_eye(const OfCamera& of_camera, bool alone) {
  if (alone && eyes_.size() > 1) {
    worker_->share([&] { of_camera(std::size_t{0}); }, [&] { of_camera(std::size_t{1}); });
    return;
  }
  for (std::size_t c = 0; c < eyes_.size(); ++c) of_camera(c);
}

/// All that can be done before the estimate of the observation before is known; asks nothing of the
/// estimator but where masks need estimates.
Pipeline::Looks Pipeline::look(const Observation& observation, bool alone) {
  Looks looks{observation.utime, std::vector<std::optional<Look>>(eyes_.size())};
  std::vector<std::optional<BinaryMask>> predicted(eyes_.size());
  for (std::size_t c = 0; masks_need_estimates() && c < eyes_.size(); ++c) {
    if (!observation.cameras[c]) continue;
    // Where nobody knows where the camera is, nor where it sees the robot: by the background, where one is known.
    const bool placed = rig_.cameras[c].mount.knowledge != PlaceKnowledge::kUnknown;
    if (placed || !learns_background()) predicted[c] = estimator_.predicted_silhouette(observation, c, true);
    if (background_watch_.moved_since_last(c, observation.cameras[c]->joints.q)) eyes_[c].segmenter.camera_turned();
  }
  const auto of_camera = [&](std::size_t c) {
    if (observation.cameras[c]) looks.of[c] = look_with(c, *observation.cameras[c], std::move(predicted[c]));
  };
  for_each_eye(of_camera, alone);
  return looks;
}

/// How far off the predicted outline may be in a picture, px: three standard deviations of hand and outline. Where
/// nobody knows them, further than the offsets that are searched for move a hand.
double Pipeline::reach_px(std::size_t camera) const {
  constexpr double kLeast_px = 6.0, kMost_px = 40.0, kYoung_px = 16.0;
  const double unit = picture_unit(rig_.cameras[camera].intrinsics);
  if (outline_sd_px_ < 0.0) return kMost_px * unit;
  return std::clamp(3.0 * outline_sd_px_ + 3.0, young_ ? kYoung_px : kLeast_px, kMost_px) * unit;
}

PredictedRobot Pipeline::prediction(std::size_t camera, const std::optional<BinaryMask>& silhouette) const {
  if (!silhouette) return {};
  if (vision_.method != SegmentationMethod::kAuto) return {&*silhouette};
  return {&*silhouette, reach_px(camera), tracking_};
}

Pipeline::Look Pipeline::look_with(std::size_t camera, const CameraObservation& seen,
                                   std::optional<BinaryMask> predicted) {
  Eye& eye = eyes_[camera];
  Look look;
  look.predicted = std::move(predicted);
  look.change = eye.picture.look(seen.image, seen.joints.q);
  if (frozen(look.change)) return look;
  if (eye.undistorter) look.straightened = eye.undistorter->apply(seen.image);
  if (vision_.method == SegmentationMethod::kGiven) {
    if (seen.given_mask.empty()) return look;  // as if it had seen nothing
    eye.given.read(seen.given_mask, eye.undistorter ? &*eye.undistorter : nullptr, look.mask, look.valid,
                   look.coverage);
    if (!eye.seen.empty()) look.leave_out_all_but(eye.seen);
    return look;
  }
  eye.segmenter.segment(look.straightened ? *look.straightened : seen.image, look.mask, look.valid, look.coverage,
                        prediction(camera, look.predicted));
  if (!eye.seen.empty()) look.leave_out_all_but(eye.seen);
  look.learning = !eye.segmenter.ready();
  return look;
}

Pipeline::Looks Pipeline::looks_at(const Observation& observation) {
  if (!ahead_.valid()) return look(observation, true);
  Looks looks = ahead_.get();
  if (looks.utime != observation.utime) {
    throw std::logic_error("Pipeline: another observation comes than was announced");
  }
  return looks;
}

bool Pipeline::segment(Observation& observation) {
  find_masks(observation);
  learn_from_masks(observation, true);
  return !learning_;
}

void Pipeline::find_masks(Observation& observation) {
  const auto start = std::chrono::steady_clock::now();
  Looks looks = looks_at(observation);
  learning_ = false;
  lessons_.assign(eyes_.size(), {});
  for (std::size_t c = 0; c < eyes_.size(); ++c) {
    if (!looks.of[c]) continue;
    Look& look = *looks.of[c];
    CameraObservation& seen = *observation.cameras[c];
    changes_[c] = look.change;
    if (look.straightened) seen.image = std::move(*look.straightened);
    seen.mask = std::move(look.mask);
    seen.mask_is_given = vision_.method == SegmentationMethod::kGiven;
    seen.valid = std::move(look.valid);
    seen.coverage = std::move(look.coverage);
    learning_ = learning_ || look.learning;
    if (frozen(look.change)) continue;
    watch_background(observation, c, look.learning);
    Lesson& lesson = lessons_[c];
    lesson.given = true;
    if (tracking_ && needs_background()) lesson.silhouette = estimator_.predicted_silhouette(observation, c, true);
    if (vision_.method == SegmentationMethod::kAuto) lesson.silhouette = std::move(look.predicted);
    lesson.trusted = tracking_;
  }
  if (learning_) {
    learn_from_masks(observation, true);
    for (auto& seen : observation.cameras) {
      if (seen) seen->mask = BinaryMask();
    }
  }
  segmentation_ms_ = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

/// What the pictures tell for the next ones: background and looks. Once for each observation.
void Pipeline::learn_from_masks(const Observation& observation, bool alone) {
  const auto of_camera = [&](std::size_t c) {
    const Lesson& lesson = lessons_[c];
    if (!lesson.given) return;
    const CameraObservation& seen = *observation.cameras[c];
    const BinaryMask* silhouette = lesson.silhouette ? &*lesson.silhouette : nullptr;
    eyes_[c].segmenter.adapt(seen.image, seen.mask, {silhouette, 0.0, lesson.trusted});
    lessons_[c].given = false;
  };
  for_each_eye(of_camera, alone);
}

/// Only methods that compare with a background that was known before; `auto` finds out by itself.
void Pipeline::watch_background(const Observation& observation, std::size_t camera, bool learning) {
  if (vision_.method != SegmentationMethod::kLearnedBackground &&
      vision_.method != SegmentationMethod::kBackgroundPicture) {
    return;
  }
  const CameraObservation& seen = *observation.cameras[camera];
  background_watch_.learned(camera, seen.joints.q);
  if (learning) return;
  const double turned_rad = background_watch_.turned(camera, seen.joints.q);
  BinaryMask robot;
  if (turned_rad > 0.0) robot = estimator_.predicted_silhouette(observation, camera, true);
  background_turned_rad_[camera] = background_watch_.count(turned_rad, seen.mask, seen.valid, robot) ? turned_rad : 0.0;
}

Estimate Pipeline::estimate(const Observation& observation) {
  Estimate estimate = estimator_.step(observation);
  if (learning_) estimate.state = EstimatorState::kLearningBackground;
  tracking_ = estimate.state == EstimatorState::kConverged;
  // A frame that contradicts what was known may show somebody's arm, or a slip: the search widens from frame to frame.
  constexpr double kWider = 1.5, kWider_px = 1.0;
  if (outline_sd_px_ >= 0.0) outline_sd_px_ = kWider * outline_sd_px_ + kWider_px;
  if (estimate.postures == 0) outline_sd_px_ = -1.0;
  young_ = estimate.postures < options_.least_postures;
  if (estimate.verdict == FrameVerdict::kAgrees && !estimate.X_CP.empty()) {
    const auto& k = rig_.cameras[0].intrinsics;
    const double hand_px =
        k.fx * estimate.hand_sd_m / std::max(estimate.X_CP[0].translation().z(), 0.1) / picture_unit(k);
    outline_sd_px_ = std::hypot(hand_px, estimate.contour_rms_px);
  }
  return estimate;
}

}  // namespace bodyschema
