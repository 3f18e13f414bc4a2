#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "harness.hpp"

/// What goes wrong in the world, for a Robot to suffer. Each call makes a fresh fault with a state of
/// its own. Joints are of the reach's robot.
namespace bodyschema::integration::faults {

using Fault = Robot::Faults;

// Cameras; 0 is left.
Fault camera_dies(std::size_t camera);
Fault both_cameras_die();
Fault camera_freezes(std::size_t camera);
Fault cameras_swapped();
/// Every message twice.
Fault pictures_doubled();
/// Every other picture comes after its successor.
Fault pictures_out_of_order();
/// In order, with true stamps, but this much later.
Fault pictures_late(Microseconds delay);
Fault picture_size_jumps();
Fault pixel_format_jumps();
/// Colour pictures come as gray ones of the same size.
Fault pixel_format_jumps_to_gray();
Fault lights_go_off();
/// Pictures of the room without the robot.
Fault hand_leaves_the_view();
/// A publisher of grey pictures, 90 ms behind, on the same connection as the robot.
Fault second_publisher();
/// The same from a connection of its own; `link` must outlive the fault.
Fault second_publisher(LcmLink& link);

// Encoders.
Fault encoders_stop();
Fault encoders_late(Microseconds delay);
Fault encoder_not_a_number();
/// What a stalled encoder reads beyond what it would read. Any thread.
class Stall {
 public:
  void add(Microseconds stamp, double rad);
  /// Between two readings on a straight line, as the service does it; zero where none are near. Radians.
  [[nodiscard]] double at(Microseconds stamp) const;

 private:
  mutable std::mutex mutex_;
  std::map<Microseconds, double> readings_;
};
/// The joint keeps the value it has, whatever the arm does, which is written to `stall`.
Fault encoder_stalls(const std::string& joint, std::shared_ptr<Stall> stall);
Fault encoder_wraps(const std::string& joint);
/// By 60 deg, to and fro.
Fault encoder_jumps(const std::string& joint);
Fault joint_missing(const std::string& joint);

// Both.
/// Stamps of everything go back by an hour.
Fault clock_steps_back();
/// Each packet is lost with this chance, and with it its message; pictures travel in eight.
Fault packets_lost(double chance, unsigned seed);
/// Half a message and 33 bytes of nonsense beside every tenth message.
Fault rubbish_between();

struct Named {
  std::string name;
  std::function<Fault()> make;
};
/// All of them. What the encoder of kStalls reads while it stalls is written to `stall`.
inline constexpr const char* kStalls = "r_elbow";
std::vector<Named> all(unsigned seed, const std::shared_ptr<Stall>& stall);

}  // namespace bodyschema::integration::faults
