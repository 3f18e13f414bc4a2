#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "bodyschema/observation/observation.hpp"

namespace bodyschema {

/// How far the encoders of a running robot err from reading to reading, told from the readings themselves: those of the
/// last seconds. It moves the hand of a single frame, however many pictures taught the offsets.
class ReadingNoise {
 public:
  /// @param believed_sd_rad  of one reading; what is measured counts where it is more
  explicit ReadingNoise(double believed_sd_rad) : believed_rad2_(believed_sd_rad * believed_sd_rad) {}
  /// The readings since the frame before.
  void read(std::span<const JointSample> encoders, bool begin_anew);
  /// Variance of a joint's angle when a picture was taken beyond what is believed, rad^2; 0: no more than that, or too
  /// few readings to tell.
  [[nodiscard]] double beyond_belief_rad2(Eigen::Index joint) const;

 private:
  double believed_rad2_;
  std::vector<JointSample> last_;
  std::size_t fresh_ = 0;  ///< readings that the noise was not told from
  Eigen::VectorXd sd_rad_;
};

}  // namespace bodyschema
