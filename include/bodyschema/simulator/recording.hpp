#pragma once

#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include "bodyschema/bus/bus_options.hpp"
#include "bodyschema/bus/message_sink.hpp"
#include "bodyschema/simulator/simulator.hpp"

namespace bodyschema::simulator {

/// How pictures travel.
enum class PictureFormat {
  kRgb,  ///< as the camera delivers them: JPEG where SimulatorSettings::jpeg_quality says so
  kGray,
  kJpeg,
  kMasks,  ///< in gray, how much of each pixel shows the robot (255: all)
};

/// Turns frames into the messages of a robot, in the order in which they would arrive: encoders at
/// their own time, both pictures together a little after the later shutter. Nothing of the truth
/// passes through here. One thread.
class FramePublisher {
 public:
  struct Options {
    Channels channels = Channels::with_prefix("ICUB");
    PictureFormat format = PictureFormat::kRgb;
    int jpeg_quality = 95;
    Microseconds utime_shift = 0;  ///< added to every stamp, to play at the present time
  };
  /// @param joint_names  in the order of the frames' joint vectors
  FramePublisher(std::vector<std::string> joint_names, Options options);

  /// Called before each message with the time at which it is due (stamps' clock, unshifted); may
  /// wait, and stops the frame by returning false.
  using Pacer = std::function<bool(Microseconds due)>;
  /// False when the pacer stopped it.
  bool publish(const SimulatedFrame& frame, MessageSink& sink, const Pacer& pacer = {});

 private:
  std::vector<std::string> joint_names_;
  Options options_;
};

/// Writes what was true to a JSON file, one line per frame:
///
///     { "offsets_deg": {joint: encoder - true},
///       "faults": [{"name", "joint", "parameter", "unit", "value", ...}],
///       "frames": [{"utime", "phase", "exposure_utime": [left, right], "true_joints_deg": {..},
///                   "hand_in_left_camera": 4x4, "hand_in_right_camera": 4x4,
///                   "fingertips_in_hand_m", "fingertips_in_left_camera_m", "fingertips_px_left", ..}] }
///
/// Where there are things beside the robot's arm, frames say "holding" and "hidden_share_left" too.
/// Of a rig with one camera, only that one is there, under its name.
/// `utime` is the stamp of the frame's first picture; joints and poses are those of the moment of
/// exposure. One thread.
class TruthWriter {
 public:
  /// Throws as open_to_write (core/write_file.hpp).
  TruthWriter(std::filesystem::path file, const Simulator& simulator, const RobotSetup& setup,
              Microseconds utime_shift = 0);
  ~TruthWriter();  ///< closes without complaint; call close() to hear of errors
  void add(const SimulatedFrame& frame);
  /// Throws DeviceError when the disk is full.
  void close();

 private:
  std::filesystem::path file_;
  std::ofstream stream_;
  std::vector<std::string> joint_names_;
  std::vector<std::string> camera_names_;
  Microseconds utime_shift_;
  bool hides_ = false;  ///< there are things that may hide the robot
  bool first_ = true;
};

}  // namespace bodyschema::simulator
