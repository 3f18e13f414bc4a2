#include "stalled_encoders.hpp"

#include <cmath>

namespace bodyschema {
namespace {

constexpr double kStands_rad = 0.0017;  // physical: 0.1 deg, the noise of a reading that stands
constexpr int kSteps = 3;               // a slip is one, seen as two at most
constexpr double kMoved_rad = 0.035;    // physical: 2 deg; less is no motion that anybody commanded

}  // namespace

std::vector<Eigen::Index> StalledEncoders::look(const Eigen::VectorXd& reading_rad) {
  std::vector<Eigen::Index> again;
  for (Eigen::Index k = 0; k < reading_rad.size(); ++k) {
    Track& track = tracks_[static_cast<std::size_t>(k)];
    if (track.known && std::abs(track.reading_rad - reading_rad(k)) <= kStands_rad) continue;
    if (track.steps > 1) again.push_back(k);
    track = {reading_rad(k), true, 0, 0.0};
  }
  return again;
}

void StalledEncoders::stepped(Eigen::Index joint, double step_rad) {
  Track& track = tracks_[static_cast<std::size_t>(joint)];
  ++track.steps;
  track.moved_rad += std::abs(step_rad);
}

Eigen::Index StalledEncoders::joint() const {
  Eigen::Index joint = -1;
  double most = kMoved_rad;
  for (std::size_t k = 0; k < tracks_.size(); ++k) {
    if (tracks_[k].steps < kSteps || tracks_[k].moved_rad <= most) continue;
    joint = static_cast<Eigen::Index>(k);
    most = tracks_[k].moved_rad;
  }
  return joint;
}

double StalledEncoders::moved_rad() const {
  const auto k = joint();
  return k < 0 ? 0.0 : tracks_[static_cast<std::size_t>(k)].moved_rad;
}

bool StalledEncoders::suspected() const {
  for (const Track& track : tracks_) {
    if (track.steps > 0) return true;
  }
  return false;
}

}  // namespace bodyschema
