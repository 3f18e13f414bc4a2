#include "reading_noise.hpp"

#include <algorithm>
#include <cmath>

#include "bodyschema/evidence/encoder_noise.hpp"
#include "limits.hpp"

namespace bodyschema {

void ReadingNoise::read(std::span<const JointSample> encoders, bool begin_anew) {
  if (begin_anew) {
    last_.clear();
    fresh_ = 0;
  }
  last_.insert(last_.end(), encoders.begin(), encoders.end());
  fresh_ += encoders.size();
  if (fresh_ < limits::kReadings) return;
  fresh_ = 0;
  if (last_.size() > 2 * limits::kReadings) last_.erase(last_.begin(), last_.end() - 2 * limits::kReadings);
  constexpr double kCalmShare = 0.5;  // of the time no robot is jerked
  sd_rad_ = encoder_noise(last_, kCalmShare);
}

double ReadingNoise::beyond_belief_rad2(Eigen::Index joint) const {
  if (joint < 0 || joint >= sd_rad_.size()) return 0.0;
  return std::max(0.0, kInterpolatedVariance * sd_rad_[joint] * sd_rad_[joint] - believed_rad2_);
}

}  // namespace bodyschema
