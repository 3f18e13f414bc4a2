#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "bodyschema/core/time.hpp"

namespace bodyschema {

/// How regularly something came: from its own stamps where it has some, else from the log's.
struct Regularity {
  std::uint64_t count = 0;
  double rate_hz = 0.0;         ///< over the time between the first and the last; 0 for fewer than two
  std::uint64_t gaps = 0;       ///< intervals of more than three times the usual (median) one
  double longest_gap_s = 0.0;   ///< longest interval of all
  std::uint64_t backwards = 0;  ///< stamps before the one before
};

struct ChannelSummary {
  std::string channel;
  std::string type;  ///< "bot_core.joint_state_t", "?" for types this project does not know
  Regularity arrivals;
  std::uint64_t bytes = 0;
  std::uint64_t unreadable = 0;  ///< messages of a known type that do not decode
};

struct PicturesSummary {
  std::string channel;
  std::string camera;    ///< "left", "right", or "camera 7"
  std::string encoding;  ///< "RGB", "BGR", "gray", "JPEG"
  int width = 0;         ///< px
  int height = 0;        ///< px
  Regularity stamps;
};

/// Encoders that come together, as those of one port of a YARP recording do.
struct EncodersSummary {
  std::vector<std::string> joints;
  Regularity stamps;
};

/// How a joint moved, as its encoder told.
struct JointMotion {
  std::string name;
  bool slides = false;  ///< then m stands for rad below, as in its messages
  std::uint64_t readings = 0;
  double lowest_rad = 0.0;
  double highest_rad = 0.0;
  double fastest_rad_s = 0.0;  ///< over 50 ms
  int turns = 0;               ///< changes of direction, each after at least half a degree or one millimetre
};

/// Postures nearer than this in every joint are the same, as for the estimator (estimator.best.same_posture_deg).
inline constexpr double kSamePosture_rad = 3.0 * 3.14159265358979323846 / 180.0;
inline constexpr std::size_t kMostPostures = 1000;

/// What a log holds, whoever recorded it: message types are told by their LCM fingerprints.
struct LogSummary {
  std::string file;
  std::uint64_t bytes = 0;
  std::uint64_t messages = 0;
  std::uint64_t damaged_places = 0;
  Microseconds begin = 0;                 ///< arrival of the first message, us since the Unix epoch
  double duration_s = 0.0;                ///< between the first and the last message
  std::vector<ChannelSummary> channels;   ///< by name
  std::vector<PicturesSummary> pictures;  ///< by channel and camera; one entry per size and encoding
  std::vector<std::string> joint_channels;
  std::vector<EncodersSummary> encoders;  ///< in the order of their first appearance
  std::vector<JointMotion> joints;        ///< in the order of their first appearance
  /// Of the instants of pictures: postures of which no two have all turning joints within kSamePosture_rad; at most
  /// kMostPostures are counted.
  std::size_t postures = 0;
  /// What was given to summarise_log(). A log itself does not say; without it every joint counts as turning.
  std::optional<std::set<std::string>> sliding_joints;

  /// For people: deg, of sliding joints mm.
  [[nodiscard]] std::string text() const;
  /// Keys end in their unit: deg, of sliding joints m; `sliding_joints` is null where these are not known.
  [[nodiscard]] std::string json() const;
};

/// Reads a log from end to end. Throws FileError when it is none.
/// @param sliding_joints  the robot's, where it is known: their readings are m, not rad
LogSummary summarise_log(const std::filesystem::path& log, std::optional<std::set<std::string>> sliding_joints = {});

}  // namespace bodyschema
