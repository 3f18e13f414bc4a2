#include "bodyschema/pipeline/pipeline.hpp"

#include <spdlog/fmt/fmt.h>

#include <chrono>
#include <fstream>
#include <iterator>

#include "bodyschema/bus/yarp_import.hpp"
#include "bodyschema/core/error.hpp"
#include "bodyschema/core/nearest_name.hpp"
#include "bodyschema/effects/online_error_model.hpp"

namespace bodyschema {
namespace {

/// A picture that does not change while a joint moves this far was not taken anew; beyond the noise
/// and rounding of encoders.
constexpr double kFrozenMotion_rad = 0.005;

/// FNV-1a, 64 bit: names a model, protects nothing.
class Digest {
 public:
  void add(const void* data, std::size_t bytes) {
    const auto* byte = static_cast<const unsigned char*>(data);
    for (std::size_t i = 0; i < bytes; ++i) state_ = (state_ ^ byte[i]) * 0x100000001b3ull;
  }
  [[nodiscard]] std::string text() const { return fmt::format("{:016x}", state_); }

 private:
  std::uint64_t state_ = 0xcbf29ce484222325ull;
};

std::optional<ErrorModel> load_error_model(const RobotSetup& setup,
                                           const std::shared_ptr<const RobotModel>& robot) {
  if (setup.extended_model.empty()) return std::nullopt;
  return ErrorModel::load(setup.extended_model, JointRoles::of(robot, setup));
}

StereoRig corrected(const StereoRig& rig, const std::optional<ErrorModel>& model) {
  return model ? model->corrected(rig) : rig;
}

std::string digest_of(const RobotSetup& setup, const RobotModel& robot,
                      const std::optional<ErrorModel>& error_model) {
  Digest digest;
  std::ifstream file(setup.model.urdf, std::ios::binary);
  const std::string urdf((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  digest.add(urdf.data(), urdf.size());
  for (const auto& part : robot.meshes()) {
    digest.add(part.link.data(), part.link.size());
    digest.add(part.mesh.vertices.data(), part.mesh.vertices.size() * sizeof(part.mesh.vertices[0]));
    digest.add(part.mesh.triangles.data(), part.mesh.triangles.size() * sizeof(part.mesh.triangles[0]));
  }
  if (error_model) {
    const std::string text = error_model->to_yaml();
    digest.add(text.data(), text.size());
  }
  return digest.text();
}

/// The robot, with every camera on one of its links.
std::shared_ptr<const RobotModel> load(const RobotSetup& setup, const StereoRig& rig) {
  auto robot = setup.load();
  for (const auto& camera : rig.cameras) {
    if (robot->has_link(camera.link)) continue;
    throw ConfigurationError(fmt::format("cameras.{}.link: '{}' is not a link of robot '{}'; did you mean '{}'?",
                                         camera.name, camera.link, robot->name(),
                                         nearest_name(camera.link, robot->link_names())));
  }
  return robot;
}

}  // namespace

Pipeline::Pipeline(const Configuration& configuration)
    : setup_(RobotSetup::from(configuration.section("robot"))),
      vision_(VisionSetup::from(configuration.section("vision"))),
      bus_(BusOptions::from(configuration.section("bus"))),
      options_(EstimatorOptions::from(configuration)),
      robot_(load(setup_, StereoRig::from(configuration.section("cameras")))),
      error_model_(load_error_model(setup_, robot_)),
      rig_(corrected(StereoRig::from(configuration.section("cameras")), error_model_)),
      estimator_(robot_, setup_, rig_, options_),
      configuration_hash_(configuration.hash()),
      model_hash_(digest_of(setup_, *robot_, error_model_)) {
  // Not ours, but checked like the rest: a robot's file may say how recordings of it are imported.
  if (configuration.has("yarp_import")) YarpImportOptions::from(configuration.section("yarp_import"));
  for (const auto& camera : rig_.cameras) {
    eyes_.push_back({Segmenter(vision_, camera.name, camera.intrinsics.width,
                               camera.intrinsics.height),
                     camera.has_distortion() ? std::optional<Undistorter>(camera) : std::nullopt});
  }
}

ObservationStream Pipeline::make_stream() const {
  ObservationStream stream(robot_, setup_, rig_, bus_);
  if (error_model_) stream.set_follower(std::make_unique<OnlineErrorModel>(robot_, setup_, *error_model_));
  return stream;
}

void Pipeline::straighten(CameraObservation& seen, std::size_t camera) {
  if (eyes_[camera].undistorter) seen.image = eyes_[camera].undistorter->apply(seen.image);
}

void Pipeline::take_background_from(Pipeline& other) {
  if (!(vision_ == other.vision_) || rig_.cameras.size() != other.rig_.cameras.size()) return;
  for (std::size_t c = 0; c < eyes_.size(); ++c) {
    const CameraModel& now = rig_.cameras[c];
    const CameraModel& before = other.rig_.cameras[c];
    if (now.name != before.name || now.link != before.link || !(now.intrinsics == before.intrinsics) ||
        now.distortion != before.distortion) {
      return;
    }
  }
  for (std::size_t c = 0; c < eyes_.size(); ++c) eyes_[c].segmenter = std::move(other.eyes_[c].segmenter);
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
    FrozenPicture& picture = eyes_[c].picture;
    picture.look(seen.image, seen.joints.q);
    if (picture.repeated() && picture.moved_rad() > kFrozenMotion_rad) {
      seen.mask = seen.valid = BinaryMask();
      seen.coverage.clear();
      continue;
    }
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
