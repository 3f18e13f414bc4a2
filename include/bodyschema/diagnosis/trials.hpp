#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "bodyschema/camera/stereo_rig.hpp"
#include "bodyschema/diagnosis/diagnoser.hpp"
#include "bodyschema/robot/robot_setup.hpp"

namespace bodyschema {

/// A robot on which trials are run.
struct TrialRobot {
  RobotSetup setup;
  StereoRig rig;
  std::shared_ptr<const RobotModel> model;
};

/// A fault hidden in a synthetic log. Values are in the units of the catalogue (deg, mm, ms, %, px,
/// kg, deg/Nm).
struct TrialFault {
  CauseName cause;      ///< of the catalogue, or outside it: wobble, velocity_lag,
                        ///< acceleration_lag, local_kink, random_walk
  double value = 0.0;
  double second = 0.0;  ///< cosine of eccentricity, second tilt, cy of a principal point; time
                        ///< share of a slip, period of a wobble in s
  double detectable = 0.0;
};

struct TrialOptions {
  double duration_s = 60.0;     ///< of which a sixth is a rest
  double picture_rate_hz = 5.0; ///< instants per second, two pictures each
  int points = 100;             ///< outline points a picture
  bool noise_burst = false;
  double mesh_pattern_px = 0.0;   ///< sd of a residual that stays with each point of the surface
  double noise_correlation_s = 0.0;  ///< of the shared noise; 0: drawn between 0.1 and 0.35 s
  bool one_way = false;           ///< one long move, never turning back
  std::vector<std::string> frozen_joints;
  /// Joints of which the second only moves with the first, half as far; empty: none.
  std::pair<std::string, std::string> locked;
  std::vector<TrialFault> faults;
};

/// A synthetic log at the level of silhouettes: true kinematics of a real robot, moved through
/// random postures before its eyes; points of its surface that lie on the outline, seen through
/// the true camera, with 0.3-0.7 px of noise, parts of it shared by a picture and correlated over
/// time; no pixels. Faults are written as what happens to motors, encoders and cameras.
class SyntheticMeasurement : public MeasurementSource {
 public:
  /// What the arm's joints really were, minus the encoders, rad: views x arm joints.
  [[nodiscard]] virtual const Eigen::MatrixXd& true_corrections() const = 0;
};
std::unique_ptr<SyntheticMeasurement> make_synthetic_log(const TrialRobot& robot,
                                                      const TrialOptions& options,
                                                      std::uint64_t seed);

/// Where a cause can sit on this robot and the smallest size found 90 % of the time (the design's
/// figures), value 0.
std::vector<TrialFault> trial_faults(const TrialRobot& robot, bool outside_catalogue);

/// One trial in figures.
struct TrialOutcome {
  std::string setting;  ///< null, background, single, limit, two, outside, outside_hard
  std::uint64_t seed = 0;
  std::vector<TrialFault> truth;
  DiagnosisReport report;
  double removable_excess = 0.0;  ///< share of it that the extension removed on held-out blocks
  double offset_error_before_deg = 0.0, offset_error_after_deg = 0.0;
  double seconds = 0.0;
};

/// The rates of the design's table.
struct TrialRates {
  std::size_t null_trials = 0, background_trials = 0, single_trials = 0, limit_trials = 0,
              two_trials = 0, outside_trials = 0, outside_hard_trials = 0;
  double null_false_alarm = 0.0;
  double background_named = 0.0;
  double single_in_class = 0.0, single_exact = 0.0, single_wrong = 0.0, single_mean_class = 0.0;
  double limit_wrong = 0.0;
  double two_both = 0.0, two_spurious = 0.0;
  double outside_unexplained = 0.0;
  double outside_hard_joint = 0.0, outside_hard_class_or_unexplained = 0.0;
  double sign = 0.0, error_median = 0.0, error_p90 = 0.0, coverage95 = 0.0;
  double removable_excess_median = 0.0, offset_improvement_median = 0.0;
};
TrialRates rates(const std::vector<TrialOutcome>& outcomes);

/// Compares a report with the truth.
bool in_class(const DiagnosisReport& report, const TrialFault& truth);
bool named_exactly(const DiagnosisReport& report, const TrialFault& truth);

/// Seeded trials of every row of the table; `singles` sets the number of single-cause logs, other
/// rows scale as in the table (200 null, 60 background, 300 single, 100 limit, 150 two, 90
/// outside, 84 outside_hard). Trials are independent and run on `threads` threads; results do not
/// depend on their number. `each` is called for every finished trial, in order.
std::vector<TrialOutcome> run_diagnosis_trials(
    const TrialRobot& robot, int singles, std::uint64_t seed, int threads = 2,
    const std::function<void(const TrialOutcome&, std::size_t done, std::size_t total)>& each = {});

}  // namespace bodyschema
