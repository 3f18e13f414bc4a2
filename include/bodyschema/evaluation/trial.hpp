#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "bodyschema/core/configuration.hpp"
#include "bodyschema/estimator/estimator.hpp"
#include "bodyschema/simulator/simulator.hpp"

namespace bodyschema {

/// One way of estimating, run beside others on the same simulated pictures.
struct Contestant {
  std::string name;  ///< "best.stereo", "paper.mono", ...
  EstimatorOptions options;
  bool mono = false;                 ///< left camera only
  bool offsets_only = false;         ///< nothing but the joints' offsets is estimated
  std::optional<Beliefs> beliefs{};  ///< instead of the trial's configuration's
};

/// What one contestant did with one frame.
struct FrameRecord {
  EstimatorState state = EstimatorState::kHandNotInView;
  /// Errors in the left and right camera; negative where that camera gave no picture.
  std::array<double, 2> position_mm{-1, -1};
  std::array<double, 2> position_sd{-1, -1};  ///< in standard deviations by the estimate's own covariance
  std::array<double, 2> rotation_deg{-1, -1};
  std::array<double, 2> nominal_mm{-1, -1};
  double hand_sd_mm = 0.0;     ///< as published
  double visible_share = 0.0;  ///< of the pictures' pixels: shows the robot, in the camera that shows more
  Eigen::VectorXd offset_deg;
  Eigen::MatrixXd covariance_deg2;
  std::vector<EstimatedParameter> effects;  ///< what else is estimated
};

struct ContestantRecord {
  std::vector<FrameRecord> frames;  ///< of the motion proper
  WeakestDirection weakest;
  double reach_miss_mm = 0.0;  ///< see TrialSetting::on_end
};

/// One simulated run watched by several contestants.
struct TrialRecord {
  std::uint64_t seed = 0;
  Eigen::VectorXd true_offset_deg;  ///< of the estimated joints
  std::vector<ContestantRecord> contestants;
};

/// The robot, rig, segmentation and simulator settings shared by the trials of one experiment.
struct TrialSetting {
  Configuration estimator;  ///< complete estimator configuration
  simulator::SimulatorSettings simulator;
  simulator::SimulationPlan plan;  ///< its seed is replaced by the trial's
  /// What befalls the masks before anybody estimates.
  std::function<void(Observation& observation)> on_masks{};
  /// Called with each contestant after each frame of the motion, counted from 0.
  std::function<void(Estimator& estimator, const Observation& observation, const TrialRecord& trial, int frame)>
      on_frame{};
  /// Called with each contestant when its last frame is done: what a robot would do with the result.
  /// @param q  encoder readings of the left camera's last picture
  std::function<void(Estimator& estimator, const RobotModel& robot, const Eigen::VectorXd& q, TrialRecord& trial,
                     std::size_t contestant)>
      on_end{};
};

/// Simulates one run in memory, segments its pictures once (background learned from the noisy
/// frames before the arm comes in), and lets every contestant estimate. Truth is only used for the
/// errors. Contestant seeds derive from `seed`.
/// @param progress  called at each frame with the share of the trial that is done; may be empty
TrialRecord run_trial(const TrialSetting& setting, const std::vector<Contestant>& contestants, std::uint64_t seed,
                      const std::function<void(double)>& progress = {});

}  // namespace bodyschema
