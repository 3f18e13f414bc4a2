#pragma once

#include <Eigen/Core>
#include <map>
#include <string>

#include "bodyschema/core/configuration.hpp"
#include "bodyschema/core/time.hpp"
#include "bodyschema/simulator/fault.hpp"
#include "bodyschema/simulator/motion_planner.hpp"

namespace bodyschema::simulator {

/// How the robot is painted.
enum class Looks {
  kGrey,    ///< every link in a shade of grey, mat
  kCovers,  ///< glossy white covers, dark joints and fingers, coloured fingertips
};

/// Outlines that a segmentation puts a little beside their place, for logs of masks: a displacement along the
/// outline's normal, Gaussian, smooth along the outline and in time.
struct OutlineNoise {
  double sd_px = 0.0;       ///< standard deviation
  double length_px = 15.0;  ///< along the outline: correlation 0.61 at this distance
  double time_s = 0.3;      ///< in time: correlation 0.37 after this; 0: each picture has its own
};

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
  double exposure_ms = 0.0;      ///< each row sees this long; 0: an instant
  double readout_ms = 0.0;       ///< from the first row to the last (rolling shutter); 0: all rows at once
  bool stamp_first_row = false;  ///< stamps are when the first row opens; else the middle of the middle row's exposure
  double lens_k1 = 0.0;          ///< radial distortion that the configured camera model lacks
  int jpeg_quality = 0;          ///< pictures go through JPEG, 1 to 100; 0: they do not
  OutlineNoise outline_noise;    ///< of masks, with Output::kSilhouettes
  // Light and paint
  Eigen::Vector3d lamp_direction_W = {-0.4, 0.5, 0.8};  ///< towards the lamp, root frame
  double ambient = 0.45;
  double diffuse = 0.55;
  std::map<std::string, Eigen::Vector3d> albedo;  ///< by link, 0 to 1; others get a shade of grey
  Looks looks = Looks::kGrey;
  double gloss = 0.5;          ///< Looks::kCovers: share of the lamp in its mirror image on the covers
  bool shadows = false;        ///< the arm shades itself, the table and what is on it
  double lamp_size_deg = 4.0;  ///< width of the lamp as seen from the scene: how soft shadows are
  double light_drift = 0.0;    ///< share by which the light has grown at the end of the motion, evenly
  double colour_drift = 0.0;   ///< share by which it has become redder and less blue by then
  double flicker = 0.0;        ///< share: each picture's light (random), or amplitude of a lamp that swings
  double flicker_hz = 0.0;     ///< how fast it swings; 0: at random from picture to picture
  // Room
  bool clutter = false;
  bool kitchen = false;  ///< instead of either: a room of walls with things (Kitchen)
  bool table = false;    ///< before the robot, with things on it, just below all that the arm passes through
  Eigen::Vector3d background_colour = {40.0, 110.0, 70.0};  ///< levels
  double background_unevenness = 0.04;                      ///< share
  // Things
  HeldThing held;               ///< kNone: the hand is empty
  bool second_arm = false;      ///< the robot's other arm, a mirror image, moves slowly on its side
  double person_every_s = 0.0;  ///< a person's arm crosses the view this often; 0: never
  double person_first_s = 3.0;  ///< ... for the first time, after the motion begins
  double person_stays_s = 2.5;  ///< ... from its coming to its going
  // Motion
  MotionSettings motion;
  int background_frames = 0;  ///< empty view before the arm appears
  int entry_frames = 0;       ///< pictures taken while the arm comes in; 0: cameras pause meanwhile
  bool head_moves = false;
  bool gaze = false;                                 ///< instead: the head follows the hand
  Microseconds start_utime = 1'600'000'000'000'000;  ///< stamp of time 0 of a recorded log

  /// Reads the section. Throws ConfigurationError.
  static SimulatorSettings from(const Configuration& simulator);
  /// The same with other values for the keys that are left out.
  static SimulatorSettings from(const Configuration& simulator, SimulatorSettings defaults);
};

}  // namespace bodyschema::simulator
