#pragma once

#include <string>
#include <vector>

#include "bodyschema/bus/lcm_link.hpp"
#include "bodyschema/bus/observation_stream.hpp"
#include "bodyschema/estimator/estimate.hpp"

namespace bodyschema {

/// Values as in offsets_status_t.
enum class HealthLevel {
  kOk = 0,     ///< estimates are current and to be relied on
  kWarn = 1,   ///< working, with something to look at
  kError = 2,  ///< no usable estimates
  kStale = 3,  ///< nothing new arrives
};
const char* to_string(HealthLevel level);

/// What is known of one camera. Ages are milliseconds on a clock that never steps; negative: never.
struct CameraFacts {
  std::string name;
  double age_ms = -1.0;                ///< since a picture of it was last worked on
  std::size_t mask_px = 0;             ///< robot pixels seen in it
  double brightness = 255.0;           ///< mean of its last picture, 0 to 255
  double unchanged_ms = 0.0;           ///< how long its pictures have been the same, bit for bit
  double moved_meanwhile_rad = 0.0;    ///< largest joint motion in that time
  double background_turned_rad = 0.0;  ///< Pipeline::background_turned_rad()
};

/// Whether its pictures have stayed the same although the arm moved.
[[nodiscard]] bool is_frozen(const CameraFacts& camera);

/// Everything the verdict rests on. Ages as in CameraFacts.
struct HealthFacts {
  std::string cameras_channel;
  std::string joints_channel;
  std::string masks_channel;
  double picture_age_ms = -1.0;  ///< since a message arrived on the cameras' channel
  double joints_age_ms = -1.0;   ///< the same for encoders
  double estimate_age_ms = -1.0;
  double busy_ms = 0.0;         ///< time the estimator has spent on the frame it is working on
  double encoder_lag_ms = 0.0;  ///< newest picture's stamp minus newest encoder stamp
  std::vector<CameraFacts> cameras;
  std::vector<std::string> missing_joints;  ///< never published and not fixed
  std::string blocking_joint;               ///< whose readings have stopped; empty: none

  BusStatistics since_last;  ///< counts since the verdict before this one
  std::uint64_t estimated_since_last = 0;
  std::uint64_t shed_since_last = 0;
  std::uint64_t failed_since_last = 0;  ///< frames that could not be worked on
  std::string frame_failure;            ///< why, of the last of them

  RefusedSources refused;            ///< the newest sender that was refused, and how many messages since
                                     ///< the verdict before this one
  Estimate estimate;                 ///< the last one; meaningless while estimate_age_ms is negative
  std::string engine_change;         ///< how drawing is not what it was at the start; empty: it is
  std::string reload_failure;        ///< why the last reload was refused; empty: none
  std::string recording_failure;     ///< empty: none
  std::uint64_t recording_lost = 0;  ///< messages
  std::string estimates_failure;     ///< of their file; empty: none
};

struct Health {
  HealthLevel level = HealthLevel::kOk;
  std::string sentence;  ///< the most important thing to know, one plain sentence
};

/// The verdict. Pure: the same facts, the same sentence.
[[nodiscard]] Health assess(const HealthFacts& facts);

}  // namespace bodyschema
