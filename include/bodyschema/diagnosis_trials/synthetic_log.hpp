#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "bodyschema/camera/stereo_rig.hpp"
#include "bodyschema/diagnosis/diagnosis_report.hpp"
#include "bodyschema/diagnosis/measurement.hpp"
#include "bodyschema/robot/robot_setup.hpp"

namespace bodyschema {

/// A robot on which trials are run.
struct TrialRobot {
  RobotSetup setup;
  StereoRig rig;
  std::shared_ptr<const RobotModel> model;
};

/// A fault hidden in a synthetic log. Values are in the units of the catalogue (docs/diagnose.md); outside it in deg
/// (wobble, local_kink), ms (velocity_lag), deg s^2/rad (acceleration_lag) and deg/log (random_walk).
struct TrialFault {
  CauseName cause;  ///< of the catalogue, or outside it: wobble, velocity_lag,
                    ///< acceleration_lag, local_kink, random_walk
  double value = 0.0;
  double second = 0.0;      ///< cosine of eccentricity, second tilt or shift of an axis, cy of a principal point, y
                            ///< of a base shift; time share of a slip, period of a wobble in s
  double detectable = 0.0;  ///< the value that is found in nine logs of ten (detectable_size)
};

struct TrialOptions {
  double duration_s = 60.0;                ///< of which a sixth is a rest
  double picture_rate_hz = 5.0;            ///< instants per second, two pictures each
  int points = 100;                        ///< outline points a picture
  bool noise_burst = false;                ///< once, for 1 to 3 s, threefold noise
  double mesh_pattern_px = 0.0;            ///< sd of a residual that stays with each point of the surface
  double noise_correlation_s = 0.0;        ///< of the shared noise; 0: drawn between 0.1 and 0.35 s
  bool one_way = false;                    ///< one long move, never turning back
  std::vector<std::string> frozen_joints;  ///< stand still throughout
  /// Joints of which the second only moves with the first, half as far; empty: none.
  std::pair<std::string, std::string> locked;
  std::vector<TrialFault> faults;
};

/// A synthetic log at the level of silhouettes: true kinematics of a real robot, moved through
/// random postures before its eyes; points of its surface that lie on the outline, seen through
/// the true camera, with 0.3-0.7 px of white noise and 0.1-0.3 px that a picture shares and that is correlated over
/// time; no pixels. Faults are written as what happens to motors, encoders and cameras.
class SyntheticMeasurement : public MeasurementSource {
 public:
  /// What the arm's joints really were, minus the encoders, rad: views x arm joints.
  [[nodiscard]] virtual const Eigen::MatrixXd& true_corrections() const = 0;
};
std::unique_ptr<SyntheticMeasurement> make_synthetic_log(const TrialRobot& robot, const TrialOptions& options,
                                                         std::uint64_t seed);

}  // namespace bodyschema
