#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "bodyschema/bus/joint_history.hpp"
#include "bodyschema/observation/observation.hpp"

namespace bodyschema {

struct SynchroniserOptions {
  /// Left and right pictures whose stamps differ by at most this are one instant.
  Microseconds pairing_window = 50'000;
  /// A picture without partner is given up once its own camera is this far ahead of it (at least
  /// the pairing window); covers cameras whose messages arrive late.
  Microseconds camera_wait = 100'000;
  /// An instant without encoders is given up once the newest picture is this far ahead of it.
  Microseconds encoder_wait = 200'000;
  /// Whether a picture is of use with its mask alone, as others find it, and comes by add_mask().
  bool masks = false;
  /// A picture without mask is given up once the newest stamp, of pictures and encoders, is this far ahead of it.
  Microseconds mask_wait = 500'000;
  /// A camera silent for longer than this counts as a gap.
  Microseconds max_image_gap = 200'000;
  /// Whether an instant with one camera missing is passed on.
  bool allow_mono = true;
  /// Stamps that go back by more than this, three times running, are a stepped clock: everything
  /// waiting is dropped and work starts anew. Smaller steps back are messages out of order.
  Microseconds clock_step = 1'000'000;
  /// Pictures waiting for a partner, per camera, and instants waiting for encoders or for the
  /// reader; beyond it the oldest is shed.
  int max_waiting = 64;
  JointHistoryOptions joints;
};

/// Why a picture that arrived whole never became part of an observation.
enum class DropReason {
  kUnpaired,      ///< no partner within the pairing window, and mono is not allowed
  kNoEncoders,    ///< no encoder reading at or after it in time, or none before it
  kMissingJoint,  ///< one joint's readings stopped or never came while others go on
  kEncoderGap,    ///< encoders were silent around it
  kEncoderJump,   ///< encoders jumped around it
  kClockStep,     ///< it was waiting when the clock stepped back
  kOverload,      ///< shed because newer ones came faster than they were used
  kOutOfOrder,    ///< its stamp is not after that of an earlier picture of its camera
  kDuplicate,     ///< a picture of that camera with the same stamp came before
  kNoMask,        ///< its mask did not come in time
};
inline constexpr std::size_t kDropReasonCount = 10;
/// Lower-case words with underscores ("no_encoders"), as used in counters.
[[nodiscard]] std::string_view name_of(DropReason reason);
/// For people, behind a number of pictures: "without encoder readings before and after".
[[nodiscard]] std::string_view in_words(DropReason reason);

struct SynchroniserStatistics {
  std::uint64_t joint_messages = 0;            ///< taken in
  std::uint64_t joint_messages_duplicate = 0;  ///< skipped
  std::uint64_t joint_messages_out_of_order = 0;
  std::uint64_t joint_messages_without_known_joint = 0;
  std::uint64_t images = 0;  ///< offered; each ends up used, dropped or waiting
  std::uint64_t images_used = 0;
  std::array<std::uint64_t, kDropReasonCount> images_dropped{};
  std::uint64_t masks = 0;              ///< offered; each ends up used, late, unused or waiting
  std::uint64_t masks_late = 0;         ///< came when their picture had been used or given up
  std::uint64_t masks_unused = 0;       ///< no picture of their camera and stamp came, or none that could be used
  std::uint64_t observations = 0;       ///< made, mono ones included
  std::uint64_t mono_observations = 0;  ///< of a rig with two cameras
  std::uint64_t gaps = 0;
  std::uint64_t clock_steps = 0;
  /// Newest picture's stamp minus newest encoder stamp when that picture came; positive: encoders late.
  Microseconds encoder_lag = 0;
  /// The joint that most recently stood in the way of an observation; -1: none.
  Eigen::Index blocking_joint = -1;

  [[nodiscard]] std::uint64_t dropped(DropReason reason) const {
    return images_dropped[static_cast<std::size_t>(reason)];
  }
  [[nodiscard]] std::uint64_t total_dropped() const;
};

/// A picture on its way into an observation.
struct StampedImage {
  int camera = 0;  ///< position in the rig
  Microseconds utime = 0;
  Image image;
  /// When it arrived by the caller's clock; handed through for latency figures, never used here.
  std::int64_t arrival_us = 0;
};

/// An observation and when the last picture in it arrived.
struct ArrivedObservation {
  Observation observation;
  std::int64_t arrival_us = 0;
};

/// Turns encoder readings and pictures into observations in acquisition order.
///
/// Pictures of two cameras are paired by their own stamps: together in one message, or nearest in
/// time within the pairing window. Encoders are interpolated linearly to each picture's stamp; an
/// instant waits for the encoder reading after it. A picture alone is passed on alone, when that is
/// allowed, once its partner cannot come any more.
///
/// Where masks are asked for, each belongs to the picture of its camera with the same stamp, and may come before or
/// after it. An instant waits for the masks of all its pictures; a picture whose mask does not come in time is left
/// out of it.
///
/// Only stamps and the order of the calls count, never the time at which they are made: a recorded
/// log gives the observations the live robot gave. Stamps of observations rise strictly, but for a
/// counted clock step. Memory is bounded whatever arrives. Pure computation; one thread; throws
/// nothing but bad_alloc.
class Synchroniser {
 public:
  /// @param joint_names  order of the joint vectors (RobotModel's)
  /// @param fixed_rad  values of joints that the robot does not publish
  /// @param cameras  1 or 2
  Synchroniser(std::vector<std::string> joint_names, const std::map<std::string, double>& fixed_rad, int cameras,
               const SynchroniserOptions& options);

  void add(const JointStateMessage& message);
  /// The pictures of one message; each camera at most once, others are ignored.
  void add(std::vector<StampedImage> images);
  /// A mask of the values of to_mask() and its picture's stamp. Nothing where no masks are asked for.
  void add_mask(StampedImage mask);
  /// The next observation, oldest first.
  std::optional<ArrivedObservation> next();
  /// Nothing more will come: pictures still without partner are settled, those without encoders
  /// dropped. next() then yields what is left.
  void finish();

  [[nodiscard]] const SynchroniserStatistics& statistics() const { return statistics_; }
  [[nodiscard]] const JointHistory& joints() const { return history_; }
  /// Pictures that are neither used nor dropped yet.
  [[nodiscard]] std::uint64_t waiting_images() const;

 private:
  struct QueuedImage {
    StampedImage image;
    std::uint64_t group = 0;  ///< pictures of one message share it
  };
  struct Camera {
    std::deque<QueuedImage> queue;
    std::deque<StampedImage> masks;  ///< whose picture may still come, or waits
    Microseconds settled = -1;       ///< stamp of the last picture that was used or given up
    Microseconds last = -1;
    int older_in_a_row = 0;
    std::array<Microseconds, 8> intervals{};  ///< between its last pictures; 0: not known
    std::size_t next_interval = 0;
    [[nodiscard]] Microseconds shortest_interval() const;
  };
  struct Instant {
    std::array<std::optional<StampedImage>, 2> images;
    [[nodiscard]] Microseconds utime() const;
    [[nodiscard]] std::uint64_t count() const;
  };

  bool admit(Camera& camera, Microseconds utime);
  void pair(bool finishing);
  void settle_alone(Camera& camera);
  void queue_instant(Instant instant);
  void resolve(bool finishing);
  /// Whether all masks are there or cannot be waited for; pictures without one are then left out of the instant.
  bool settle_masks(Instant& instant, bool finishing);
  std::deque<StampedImage>::iterator mask_of(const StampedImage& picture);
  void settle(const StampedImage& picture);
  void drop(const Instant& instant, DropReason reason);
  void count_dropped(DropReason reason, std::uint64_t images = 1);
  void start_anew();

  SynchroniserOptions options_;
  JointHistory history_;
  std::vector<Camera> cameras_;
  std::deque<Instant> instants_;
  std::deque<ArrivedObservation> ready_;
  Microseconds newest_image_ = -1, newest_joints_ = -1;  ///< of the last message of either
  Microseconds last_emitted_ = -1;
  int older_joints_in_a_row_ = 0;
  std::uint64_t group_ = 0;
  SynchroniserStatistics statistics_;
};

}  // namespace bodyschema
