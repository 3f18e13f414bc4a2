#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "bodyschema/bus/observation_stream.hpp"
#include "bodyschema/evidence/picture_log.hpp"
#include "bodyschema/evidence/state.hpp"
#include "bodyschema/pipeline/pipeline.hpp"

namespace bodyschema {

struct WatchOptions {
  std::filesystem::path log;
  double picture_rate_hz = 10.0;  ///< at most so many pictures a second and camera are looked at
  std::size_t kept = 32;          ///< observations whose pictures are kept for people, spread over the log
  bool quiet = false;             ///< no progress bar
};

/// A log with the robot's outlines found in its pictures: what calibration and diagnosis work on.
struct WatchedLog {
  PictureLog pictures;
  std::vector<Observation> kept;  ///< pictures and masks of some of them, in order of time
  std::map<std::string, double>
      offsets_at_start;  ///< by joint, rad: where the estimator was at the last frame it looked at
  BusStatistics bus;
  std::vector<std::string> missing_joints;  ///< of which no reading came
  std::size_t pictures_seen = 0, pictures_with_robot = 0;
  std::size_t frames_looked_at = 0, frames_swapped = 0;  ///< by the estimator, at the beginning
  /// The cameras turned before a room, and the background that was learned is of no use: reading ended there.
  bool background_turned = false;
};

/// What is said of a log that was read once more, as its learned background had turned away.
inline constexpr const char* kReadWithoutBackground =
    "a camera turned before a room, and a learned background is of no use then: masks were looked for around the "
    "predicted robot, as by vision.method: statistics";

/// The parameters of a state, joints' offsets where the estimator was (WatchedLog::offsets_at_start).
Eigen::VectorXd at_start(const WatchedLog& log, const State& state);

/// Reads a log's pictures and encoders and finds the masks as configured. A background that is to be learned is learned
/// from the whole log first.
/// @param estimate_first  lets the estimator look at the beginning of the log, for a start and for exchanged eyes;
///   masks that need estimates (`statistics`) have it look at all of it
/// Throws Error.
WatchedLog watch_log(Pipeline& pipeline, const WatchOptions& options, bool estimate_first);

/// Of a log of which no picture was used: the reasons with their numbers, and what to look at; empty where none came.
std::string why_no_picture(const BusStatistics& bus, const StereoRig& rig, const Channels& channels);

/// Refuses a log in which there is nothing to work with, in one sentence that says what it lacks and what to record.
/// @param advice  what to record, for the end of the sentence
/// Throws DataError.
void refuse_unusable(const WatchedLog& log, const std::filesystem::path& file, const Channels& channels,
                     const std::string& advice);

}  // namespace bodyschema
