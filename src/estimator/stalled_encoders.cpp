#include "stalled_encoders.hpp"

#include <algorithm>
#include <cmath>

namespace bodyschema {
namespace {

constexpr double kStands_rad = 0.0017;  // physical: 0.1 deg, the noise of a reading that stands
constexpr int kSteps = 3;               // a slip is one, seen as two at most
constexpr double kMoved_rad = 0.035;    // physical: 2 deg; less is no motion that anybody commanded
constexpr double kSure_sd = 4.0;        // statistical: pictures' own error is not taken for motion

}  // namespace

bool StalledEncoders::Track::goes_on() const {
  return (steps >= kSteps && step_rad > kMoved_rad) || went_on_rad() > kMoved_rad;
}

std::vector<StalledEncoders::Resumed> StalledEncoders::look(const Eigen::VectorXd& reading_rad, double time_s) {
  std::vector<Resumed> again;
  bool moved = false;
  for (Eigen::Index k = 0; k < reading_rad.size(); ++k) {
    Track& track = tracks_[static_cast<std::size_t>(k)];
    if (track.known && std::abs(track.reading_rad - reading_rad(k)) <= kStands_rad) continue;
    if (track.steps > 0)
      again.push_back({k, track.stepped_s, track.before_rad, track.steps > 1 || track.went_on_rad() > 0.0});
    track = {};
    track.reading_rad = reading_rad(k);
    track.since_s = time_s;
    track.known = true;
    moved = true;
  }
  // Of those that moved together none has stood while others did.
  for (auto& track : tracks_) track.others_moved |= moved && track.since_s != time_s;
  return again;
}

void StalledEncoders::stepped(Eigen::Index joint, double step_rad, double offset_rad, double time_s) {
  Track& track = tracks_[static_cast<std::size_t>(joint)];
  if (++track.steps == 1) {
    track.stepped_s = time_s;
    track.before_rad = offset_rad - step_rad;
    track.least_rad = track.greatest_rad = offset_rad;
  }
  track.step_rad += std::abs(step_rad);
}

void StalledEncoders::seen(const Eigen::VectorXd& offset_rad, const Eigen::VectorXd& sd_rad) {
  for (const auto k : suspects()) {
    Track& track = tracks_[static_cast<std::size_t>(k)];
    track.least_rad = std::min(track.least_rad, offset_rad(k) + kSure_sd * sd_rad(k));
    track.greatest_rad = std::max(track.greatest_rad, offset_rad(k) - kSure_sd * sd_rad(k));
  }
}

Eigen::Index StalledEncoders::joint() const {
  Eigen::Index joint = -1;
  double most = 0.0;
  for (std::size_t k = 0; k < tracks_.size(); ++k) {
    if (!tracks_[k].goes_on() || tracks_[k].moved_rad() <= most) continue;
    joint = static_cast<Eigen::Index>(k);
    most = tracks_[k].moved_rad();
  }
  return joint;
}

double StalledEncoders::moved_rad() const {
  const auto k = joint();
  return k < 0 ? 0.0 : tracks_[static_cast<std::size_t>(k)].moved_rad();
}

std::vector<Eigen::Index> StalledEncoders::suspects() const {
  std::vector<Eigen::Index> list;
  for (std::size_t k = 0; k < tracks_.size(); ++k) {
    if (tracks_[k].steps > 0) list.push_back(static_cast<Eigen::Index>(k));
  }
  return list;
}

std::vector<Eigen::Index> StalledEncoders::standing_while_others_move() const {
  std::vector<Eigen::Index> list;
  for (std::size_t k = 0; k < tracks_.size(); ++k) {
    if (tracks_[k].others_moved) list.push_back(static_cast<Eigen::Index>(k));
  }
  return list;
}

double StalledEncoders::standing_since_s(Eigen::Index joint) const {
  return tracks_[static_cast<std::size_t>(joint)].since_s;
}

}  // namespace bodyschema
