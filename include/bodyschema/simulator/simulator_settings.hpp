#pragma once

#include <Eigen/Core>
#include <map>
#include <string>

#include "bodyschema/core/configuration.hpp"
#include "bodyschema/core/time.hpp"
#include "bodyschema/simulator/motion_planner.hpp"

namespace bodyschema::simulator {

/// The `simulator` section: what kind of robot and room is played. Nothing in it is a secret to the
/// estimator; offsets and faults are given per run (SimulationPlan), never by configuration.
struct SimulatorSettings {
  // Encoders
  double encoder_rate_hz = 100.0;
  double encoder_noise_deg = 0.02;  ///< standard deviation
  int encoder_bits = 12;            ///< steps per turn: 2^bits; 0: no rounding
  // Cameras
  double camera_rate_hz = 30.0;
  double right_camera_delay_ms = 3.0;  ///< right shutter and stamp after the left
  double stamp_jitter_ms = 0.5;        ///< standard deviation of shutter times; stamps stay true
  int supersampling = 3;               ///< samples per pixel along each axis
  double blur_px = 0.4;                ///< standard deviation
  double noise_levels = 2.5;           ///< standard deviation per channel, of 255
  double exposure_swing = 0.0;         ///< share; exposure breathes by this much
  double exposure_period_s = 8.0;
  // Light and paint
  Eigen::Vector3d lamp_direction_W = {-0.4, 0.5, 0.8};  ///< towards the lamp, root frame
  double ambient = 0.45;
  double diffuse = 0.55;
  std::map<std::string, Eigen::Vector3d> albedo;  ///< by link, 0 to 1; others get a shade of grey
  // Room
  bool clutter = false;
  Eigen::Vector3d background_colour = {40.0, 110.0, 70.0};  ///< levels
  double background_unevenness = 0.04;                      ///< share
  // Motion
  MotionSettings motion;
  int background_frames = 0;  ///< empty view before the arm appears
  int entry_frames = 0;       ///< pictures taken while the arm comes in; 0: cameras pause meanwhile
  bool head_moves = false;
  Microseconds start_utime = 1'600'000'000'000'000;  ///< stamp of time 0 of a recorded log

  /// Reads the section. Throws ConfigurationError.
  static SimulatorSettings from(const Configuration& simulator);
};

}  // namespace bodyschema::simulator
