#include "bodyschema/estimator/stalled_encoders.hpp"

#include <algorithm>
#include <cmath>

namespace bodyschema {
namespace {

constexpr double kStands_rad = 0.0017;  // 0.1 deg; the noise of a reading that stands
constexpr double kMove_rad = 0.0262;    // 1.5 deg; what counts as having moved ...
constexpr double kMove_sd = 4.0;        // ... and is beyond the uncertainty
constexpr int kFramesOfMove = 3;        // one frame may be a stray
constexpr int kMoves = 3;               // a slip is one, seen as two at most
constexpr double kShows_rad = 0.0524;   // 3 deg; an error that no memory outlives
constexpr std::size_t kGoesOn = 10;     // frames
constexpr double kRun_rad = 0.0175;     // 1 deg; less the same way may be noise
constexpr double kRuns_rad_s = 0.105;   // 6 deg/s; a slower joint's error stays within 1 deg until it shows

}  // namespace

bool StalledEncoders::Track::moved_to(double reading) const {
  return std::abs(reading_rad - reading) > kStands_rad;
}

StalledEncoders::Track StalledEncoders::Track::moved_on(double time_s, double reading) const {
  Track next;
  next.reading_rad = reading;
  next.since_s = time_s;
  if (time_s <= since_s) return next;
  next.step_rad_s = (reading - reading_rad) / (time_s - since_s);
  next.run_rad = std::abs(reading - reading_rad);
  if (next.step_rad_s * step_rad_s <= 0.0) return next;
  next.run_rad += run_rad;
  next.deceleration_rad_s2 = std::max(0.0, std::abs(step_rad_s) - std::abs(next.step_rad_s)) / (time_s - since_s);
  return next;
}

double StalledEncoders::Track::gone_on_rad(double time_s) const {
  const double speed_rad_s = std::abs(step_rad_s);
  if (run_rad < kRun_rad || speed_rad_s < kRuns_rad_s || stood > kGoesOn) return 0.0;
  double t = std::max(0.0, time_s - since_s);
  if (deceleration_rad_s2 > 0.0) t = std::min(t, speed_rad_s / deceleration_rad_s2);
  const double path_rad = speed_rad_s * t - 0.5 * deceleration_rad_s2 * t * t;
  return path_rad > kShows_rad ? 0.0 : std::max(0.0, path_rad - kStands_rad);
}

bool StalledEncoders::ends(const Eigen::VectorXd& reading_rad) const {
  std::size_t shortest = kTaught;
  for (const Track& track : tracks_) shortest = std::min(shortest, track.stood);
  for (Eigen::Index k = 0; k < reading_rad.size(); ++k) {
    const Track& track = tracks_[static_cast<std::size_t>(k)];
    if (track.stood < kBriefly || !track.moved_to(reading_rad(k))) continue;
    // An arm that is held still stands in all its joints; what made it drop a memory is something else.
    const bool alone = track.stood > shortest + kBriefly;
    if (track.moves > 0 || (alone && frames_since_drop_ < std::min(track.stood, kTaught))) return true;
  }
  return false;
}

double StalledEncoders::Track::drift_rad() const {
  if (recent == 0) return 0.0;
  const auto end = recent_rad.begin() + static_cast<std::ptrdiff_t>(std::min(recent, kRecent));
  const auto [low, high] = std::minmax_element(recent_rad.begin(), end);
  return *high - *low;
}

void StalledEncoders::look(double time_s, const Eigen::VectorXd& reading_rad, const Eigen::VectorXd& offset_rad,
                           const Eigen::VectorXd& sd_rad, bool fits, bool settled, bool remembers) {
  joint_ = -1;
  doubtful_ = false;
  dropped_while_standing_ = false;
  remembered_ = remembered_ || remembers;
  frames_since_drop_ = remembered_ && !remembers ? 0 : frames_since_drop_ + 1;
  for (Eigen::Index k = 0; k < reading_rad.size(); ++k) {
    Track& track = tracks_[static_cast<std::size_t>(k)];
    if (track.stood == 0) {
      track.reading_rad = reading_rad(k);
      track.since_s = time_s;
    } else if (track.moved_to(reading_rad(k))) {
      track = track.moved_on(time_s, reading_rad(k));
    }
    if (!settled) {
      track.recent = 0;
    } else if (fits) {
      track.recent_rad[track.recent++ % kRecent] = offset_rad(k);
    }
    drift_rad_(k) = settled ? std::max(track.drift_rad(), track.gone_on_rad(time_s)) : 0.0;
    ++track.frames_since;
    ++track.stood;
    if (track.stood >= kBriefly && frames_since_drop_ < kRecent) dropped_while_standing_ = true;
    if (fits) {
      const double away_rad = std::abs(offset_rad(k) - track.offset_rad);
      track.away = track.known && away_rad > std::max(kMove_rad, kMove_sd * std::hypot(sd_rad(k), track.sd_rad))
                       ? track.away + 1
                       : 0;
      if (track.away >= kFramesOfMove) {
        ++track.moves;
        track.moved_rad += away_rad;
        track.frames_since = 0;
      }
      if (!track.known || track.away >= kFramesOfMove) {
        track.known = true;
        track.offset_rad = offset_rad(k);
        track.sd_rad = sd_rad(k);
        track.away = 0;
      }
    }
    doubtful_ = doubtful_ || (track.moves > 0 && track.frames_since < kRecent);
    if (track.moves >= kMoves && (joint_ < 0 || track.moved_rad > moved_rad())) joint_ = k;
  }
}

}  // namespace bodyschema
