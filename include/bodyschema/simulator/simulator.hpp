#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bodyschema/geometry/binary_mask.hpp"
#include "bodyschema/geometry/image.hpp"
#include "bodyschema/observation/observation.hpp"
#include "bodyschema/robot/robot_setup.hpp"
#include "bodyschema/simulator/fault.hpp"
#include "bodyschema/simulator/simulator_settings.hpp"
#include "bodyschema/simulator/true_robot.hpp"

namespace bodyschema::simulator {

enum class Motion { kReach, kBabble, kOneWay, kPoses, kGiven };
enum class Phase { kBackground, kEntry, kMotion };
/// "background", "entry", "motion".
const char* name_of(Phase phase);

/// How much of each frame is worked out.
enum class Output {
  kPictures,     ///< RGB pictures (and silhouettes)
  kSilhouettes,  ///< exact masks and coverage only: no room, no light, no noise but OutlineNoise
  kJoints,       ///< encoders and truth only
};

/// One run: what is done and what is wrong. This is the truth that stays out of every message.
struct SimulationPlan {
  std::uint64_t seed = 1;
  Motion motion = Motion::kReach;
  int frames = 100;       ///< of a reach (camera frames from its first to its last posture)
  double seconds = 60.0;  ///< of babbling or of the one-way move
  int poses = 70;         ///< postures of Motion::kPoses
  /// Motor angles over time for Motion::kGiven; time 0 is the beginning of the motion.
  std::optional<Trajectory> given;
  std::map<std::string, double> offsets_deg;  ///< encoder = true + offset, by joint
  std::vector<FaultSpec> faults;
  std::vector<std::string> frozen_joints;  ///< arm joints that never move
  /// Seconds after the motion begins at which a camera (0 left, 1 right) dies.
  std::optional<std::pair<std::size_t, double>> camera_dies;
  Output output = Output::kPictures;
  int threads = 1;  ///< 2 draws both pictures of a frame at the same time
};

/// What was true when one camera's picture was taken: in the middle of the exposure of its middle row.
struct CameraTruth {
  Microseconds exposure_utime = 0;             ///< differs from the stamp by latency and skew
  Eigen::VectorXd q;                           ///< true joint angles, radians, RobotModel order
  Pose X_CP = Pose::Identity();                ///< hand in the true camera
  Pose X_WC = Pose::Identity();                ///< true camera in the root frame
  std::vector<Eigen::Vector3d> fingertips_C;   ///< metres, RobotSetup::fingertip_links
  std::vector<Eigen::Vector2d> fingertips_px;  ///< by the true lens
  double visible_share = 0.0;                  ///< of the picture's pixels that show the robot; 0 without pictures
  double hidden_share = 0.0;                   ///< of the robot's picture that other things hide
  bool holding = false;                        ///< the hand holds a thing
};

/// One picture as a camera delivers it.
struct CameraFrame {
  std::string name;                ///< the rig's: "left", "right"
  int number = 0;                  ///< in messages: CameraModel::number()
  Microseconds utime = 0;          ///< stamp
  Image image;                     ///< RGB; empty unless Output::kPictures
  std::vector<std::uint8_t> jpeg;  ///< `image` as the camera compressed it; empty: it did not
  /// What is seen of the robot: exact (but for OutlineNoise), over the time of exposure mostly there; empty with
  /// Output::kJoints.
  BinaryMask silhouette;
  std::vector<std::uint8_t> coverage;  ///< share of each pixel that is robot, 0-255, row order
};

/// One instant of the cameras and the encoder samples up to it.
struct SimulatedFrame {
  int index = 0;
  Phase phase = Phase::kMotion;
  Microseconds utime = 0;                           ///< stamp of the first camera present
  std::vector<std::optional<CameraFrame>> cameras;  ///< absent: the camera is dead
  std::vector<CameraTruth> truth;                   ///< one per camera, dead ones included
  /// Encoder readings since the last frame, oldest first: they reach at least one sample beyond the
  /// latest stamp of this frame, so that its joints can be interpolated at once. Velocities are
  /// backward differences of the readings over 50 ms.
  std::vector<JointSample> encoders;
};

/// The stand-in robot, in process: deterministic by seed, the same frames in the same order on every
/// run and with any number of threads. Never sees the estimator's model of errors; draws with its
/// own rasteriser.
///
///     Simulator simulator(model, setup, rig, settings, plan);
///     while (auto frame = simulator.next()) { ... }
///
/// Construction throws ConfigurationError for faults, joints or settings that cannot be and
/// DataError when no motion is found. One thread.
class Simulator {
 public:
  Simulator(std::shared_ptr<const RobotModel> model, const RobotSetup& setup, const StereoRig& rig,
            SimulatorSettings settings, SimulationPlan plan);
  ~Simulator();
  Simulator(Simulator&&) noexcept;

  /// The next frame, or nothing at the end.
  std::optional<SimulatedFrame> next();
  [[nodiscard]] int frame_count() const;
  /// Frames before the motion proper.
  [[nodiscard]] int first_motion_frame() const;

  /// Whether there are things in the scene beside the robot's arm (a table, a held thing, other arms).
  [[nodiscard]] bool has_things() const;

  [[nodiscard]] const TrueRobot& robot() const;
  [[nodiscard]] const SimulationPlan& plan() const;
  [[nodiscard]] const SimulatorSettings& settings() const;
  [[nodiscard]] const RobotModel& model() const;
  /// Names of joints in the order of every joint vector.
  [[nodiscard]] std::vector<std::string> joint_names() const;
  /// Duration of the whole log, seconds.
  [[nodiscard]] double duration_s() const;
  /// What the empty room looks like to a camera with the head as at the beginning, without noise:
  /// for tests only, an estimator must learn it.
  [[nodiscard]] Image room(std::size_t camera) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// The site of a run's faults, without running it: for drawing hidden faults.
FaultSite fault_site(const std::shared_ptr<const RobotModel>& model, const RobotSetup& setup, const StereoRig& rig,
                     const SimulatorSettings& settings, const SimulationPlan& plan);

/// A frame as the estimator takes it in: encoders interpolated linearly to each stamp. `history`
/// are the encoder samples received so far, oldest first, this frame's included.
Observation to_observation(const SimulatedFrame& frame, std::span<const JointSample> history);

}  // namespace bodyschema::simulator
