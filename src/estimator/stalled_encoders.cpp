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

}  // namespace

bool StalledEncoders::Track::moved_to(double reading) const { return std::abs(reading_rad - reading) > kStands_rad; }

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

void StalledEncoders::look(const Eigen::VectorXd& reading_rad, const Eigen::VectorXd& offset_rad,
                           const Eigen::VectorXd& sd_rad, bool fits, bool settled, bool remembers) {
  joint_ = -1;
  doubtful_ = false;
  dropped_while_standing_ = false;
  remembered_ = remembered_ || remembers;
  frames_since_drop_ = remembered_ && !remembers ? 0 : frames_since_drop_ + 1;
  for (Eigen::Index k = 0; k < reading_rad.size(); ++k) {
    Track& track = tracks_[static_cast<std::size_t>(k)];
    if (track.moved_to(reading_rad(k))) {
      track = {};
      track.reading_rad = reading_rad(k);
    }
    if (!settled) {
      track.recent = 0;
    } else if (fits) {
      track.recent_rad[track.recent++ % kRecent] = offset_rad(k);
    }
    drift_rad_(k) = track.drift_rad();
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
