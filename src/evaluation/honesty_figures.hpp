#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "experiments.hpp"

namespace bodyschema {

/// What one frame said, and how wrong it was.
struct HonestyFrame {
  bool converged = false;
  bool in_view = false;                 ///< some of the robot is in some picture
  std::optional<double> hand_error_mm;  ///< of the hand's place in the first camera
  double hand_sd_mm = 0.0;              ///< published: root of the summed variances; 0: none was published
  Eigen::VectorXd offset_error_deg;     ///< per estimated joint
  Eigen::VectorXd offset_sd_deg;        ///< published

  /// Wrong by more than the published uncertainty can be meant to allow: the hand by more than 3 sd and 2 mm, or a
  /// joint's offset by more than 5 sd.
  [[nodiscard]] bool wrong() const;
};

using HonestyLog = std::vector<HonestyFrame>;

/// How far what is published of some logs can be believed. Rates are 0 to 1.
struct HonestyFigures {
  std::size_t logs = 0;
  double dishonest_frame_rate = 0.0;       ///< of the converged frames: wrong
  double dishonest_log_rate = 0.0;         ///< of the logs: with any such frame
  double coverage95 = 0.0;                 ///< of the joints' 95 % intervals in converged frames: those that hold
  double unconverged_hand_coverage = 0.0;  ///< of the other frames: hand within 3 sd
  double hand_sd_published_rate = 0.0;     ///< of the frames with the hand in view
  double converged_rate = 0.0;             ///< of the frames
  double converged_within_45_rate = 0.0;   ///< of the logs: converged in one of the first 45 frames
  double sd_to_error_median = 0.0;         ///< of the converged frames: published hand sd over the hand's error
  double half_width95_median_deg = 0.0;    ///< of the joints' 95 % intervals in the last frame of each log
};

HonestyFigures honesty_figures(const std::vector<const HonestyLog*>& logs);
Json to_json(const HonestyFigures& figures);

/// Frames of one contestant of a trial: the first camera counts.
HonestyLog honesty_log(const TrialRecord& trial, std::size_t contestant);

}  // namespace bodyschema
