#include "bodyschema/pipeline/pipeline.hpp"

#include <chrono>

#include "bodyschema/bus/yarp_import.hpp"

namespace bodyschema {

Pipeline::Pipeline(const Configuration& configuration)
    : setup_(RobotSetup::from(configuration.section("robot"))),
      rig_(StereoRig::from(configuration.section("cameras"))),
      vision_(VisionSetup::from(configuration.section("vision"))),
      bus_(BusOptions::from(configuration.section("bus"))),
      options_(EstimatorOptions::from(configuration)),
      robot_(setup_.load()),
      estimator_(robot_, setup_, rig_, options_),
      configuration_hash_(configuration.hash()) {
  // Not ours, but checked like the rest: a robot's file may say how recordings of it are imported.
  if (configuration.has("yarp_import")) YarpImportOptions::from(configuration.section("yarp_import"));
  for (const auto& camera : rig_.cameras) {
    eyes_.push_back({Segmenter(vision_, camera.name, camera.intrinsics.width,
                               camera.intrinsics.height),
                     camera.has_distortion() ? std::optional<Undistorter>(camera) : std::nullopt});
  }
}

ObservationStream Pipeline::make_stream() const {
  return {robot_, setup_, rig_, bus_};
}

void Pipeline::straighten(CameraObservation& seen, std::size_t camera) {
  if (eyes_[camera].undistorter) seen.image = eyes_[camera].undistorter->apply(seen.image);
}

void Pipeline::learn_from(const Observation& observation) {
  for (std::size_t c = 0; c < eyes_.size(); ++c) {
    if (!observation.cameras[c]) continue;
    const Image& image = observation.cameras[c]->image;
    eyes_[c].segmenter.learn_from(eyes_[c].undistorter ? eyes_[c].undistorter->apply(image) : image);
  }
}

void Pipeline::finish_learning() {
  for (auto& eye : eyes_) eye.segmenter.finish_learning();
}

Estimate Pipeline::process(Observation& observation) {
  segment(observation);
  return estimate(observation);
}

bool Pipeline::segment(Observation& observation) {
  const auto start = std::chrono::steady_clock::now();
  learning_ = false;
  const bool predict = tracking_ || vision_.method == SegmentationMethod::kStatistics;
  for (std::size_t c = 0; c < eyes_.size(); ++c) {
    if (!observation.cameras[c]) continue;
    CameraObservation& seen = *observation.cameras[c];
    straighten(seen, c);
    BinaryMask predicted;
    if (predict) predicted = estimator_.predicted_silhouette(observation, c, true);
    eyes_[c].segmenter.segment(seen.image, seen.mask, seen.valid, seen.coverage,
                               predict ? &predicted : nullptr);
    learning_ = learning_ || !eyes_[c].segmenter.ready();
  }
  if (learning_) {
    for (auto& seen : observation.cameras) {
      if (seen) seen->mask = BinaryMask();
    }
  }
  segmentation_ms_ =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  return !learning_;
}

Estimate Pipeline::estimate(const Observation& observation) {
  Estimate estimate = estimator_.step(observation);
  if (learning_) estimate.state = EstimatorState::kLearningBackground;
  tracking_ = estimate.state == EstimatorState::kConverged;
  return estimate;
}

}  // namespace bodyschema
