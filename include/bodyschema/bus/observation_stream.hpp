#pragma once

#include <array>
#include <chrono>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "bodyschema/bus/bus_options.hpp"
#include "bodyschema/bus/joint_assembler.hpp"
#include "bodyschema/camera/stereo_rig.hpp"
#include "bodyschema/robot/robot_model.hpp"
#include "bodyschema/robot/robot_setup.hpp"

namespace bodyschema {

struct BusStatistics {
  std::uint64_t messages = 0;            ///< on our two input channels
  std::uint64_t messages_malformed = 0;  ///< not used as a whole
  std::uint64_t images_malformed = 0;    ///< pictures of good messages that could not be used
  std::uint64_t lost_in_queue = 0;       ///< LostMessages, which the network's side fills in
  std::uint64_t lost_incomplete = 0;
  /// Messages, pictures and masks by what was wrong with them.
  std::array<std::uint64_t, kMessageFaultCount> faults{};
  SynchroniserStatistics synchroniser;

  /// Every counter of what was not used, e.g. {"malformed.truncated", 3}, {"dropped.overload", 0},
  /// {"joint_state.out_of_order", 1}; the order is fixed.
  [[nodiscard]] std::vector<std::pair<std::string, std::uint64_t>> counters() const;
  /// How many pictures were not used and why, in one sentence; empty where that is at most this share of all.
  [[nodiscard]] std::string lost_pictures(double tolerable_share) const;
};

/// Joints that move nothing that is seen or sees, neither rendered links, hand and fingertips nor cameras: they need
/// not be published.
[[nodiscard]] std::set<std::string> idle_joints(const std::shared_ptr<const RobotModel>& robot, const RobotSetup& setup,
                                                const StereoRig& rig);

/// From raw messages to observations: decodes, refuses what is malformed, synchronises. The live
/// daemon, replay and diagnosis all enter here, so that the same messages in the same order give
/// the same observations.
///
/// What is wrong with a message is counted, and said in the log at once and then at most every five
/// seconds per kind. receive() never throws on account of a message. One thread.
class ObservationStream {
 public:
  /// @param joint_names  RobotModel order
  /// @param fixed_rad  values of joints the robot does not publish
  /// @param cameras  the rig's: one or two, by their numbers in messages; pictures of another size are
  ///        refused. Throws ConfigurationError for more, or another order.
  ObservationStream(const std::vector<std::string>& joint_names, const std::map<std::string, double>& fixed_rad,
                    const std::vector<CameraModel>& cameras, const BusOptions& options);
  /// For a configured robot. A joint that moves a rendered link, the hand, a fingertip or a camera
  /// must be published or fixed; all others (the other arm, legs) rest at their default.
  ObservationStream(const std::shared_ptr<const RobotModel>& robot, const RobotSetup& setup, const StereoRig& rig,
                    const BusOptions& options);

  /// Pictures of this camera are gray (1 channel) or in colour (3) for good: its background is given.
  /// Otherwise its first picture decides; another kind is refused, unless it comes for some ten seconds
  /// (300 pictures in a row), which is another camera.
  void expect_channels(std::size_t camera, int channels);
  /// Pictures of this camera are reduced as they are unpacked (picture_reduction). Masks are not.
  /// @param reduction  1, 2, 4 or 8, dividing both sides of its pictures
  void reduce(std::size_t camera, int reduction);

  /// @param arrival_us  the caller's clock, handed through to ArrivedObservation
  /// @return whether the channel is one of our inputs
  bool receive(std::string_view channel, Bytes message, std::int64_t arrival_us = 0);
  /// The next observation, oldest first, with the encoder samples since the one before. Call until empty after each
  /// receive().
  std::optional<ArrivedObservation> next();
  /// End of the recording: settles what waits; next() yields the rest.
  void finish();

  [[nodiscard]] BusStatistics statistics() const;
  [[nodiscard]] const Synchroniser& synchroniser() const { return synchroniser_; }
  [[nodiscard]] const Channels& channels() const { return channels_; }
  /// Whether pictures are of use with their masks alone (SynchroniserOptions::masks), which come on channels().masks.
  [[nodiscard]] bool expects_masks() const { return options_.synchroniser.masks; }

 private:
  struct CameraFormat {
    std::string name;
    int type;  ///< bot_core::images_t
    int width;
    int height;
    int reduction = 1;
    int channels = 0;  ///< of its pictures; 0: none came yet
    bool channels_given = false;
    int other_kind_in_a_row = 0;
  };
  struct Complaint {
    std::chrono::steady_clock::time_point last{};
    std::uint64_t held_back = 0;
  };
  /// With the idle joints in `options`.
  ObservationStream(const RobotModel& robot, const RobotSetup& setup, const std::vector<CameraModel>& cameras,
                    const BusOptions& options);
  void receive_joints(Bytes message);
  void keep_encoders();
  void receive_images(Bytes message, std::int64_t arrival_us);
  void receive_masks(Bytes message, std::int64_t arrival_us);
  static DecodeResult admit_kind(CameraFormat& camera, int channels);
  void refuse(const std::string& source, const DecodeResult& result);
  void warn_of_missing_joints();
  bool may_complain(Complaint& complaint);

  std::vector<CameraFormat> cameras_;
  BusOptions options_;
  Channels channels_;
  Synchroniser synchroniser_;
  JointAssembler assembler_;
  std::vector<JointSample> encoders_;  ///< since the last observation
  bool encoders_begin_anew_ = false;
  std::uint64_t clock_steps_ = 0;  ///< when the last sample was kept
  Microseconds kept_ = -1;         ///< that sample's stamp
  BusStatistics statistics_;
  JointStateMessage joint_state_;
  ImagesView images_;
  std::map<std::pair<std::string, MessageFault>, Complaint> complaints_;
  Complaint missing_joints_;
};

}  // namespace bodyschema
