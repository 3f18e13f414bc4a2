#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "bodyschema/geometry/image.hpp"

namespace bodyschema {

/// A picture that stays the same, bit for bit, while a joint moves this far was not taken anew: beyond the noise and
/// rounding of encoders. Such pictures are left out, and the service says so of a camera that goes on with them.
inline constexpr double kFrozenMotion_rad = 0.005;

/// What is known of one camera's picture against those before it.
struct PictureChange {
  bool repeated = false;   ///< the last picture was the same as the one before
  double moved_rad = 0.0;  ///< the furthest that any joint has moved since the first of these pictures
};

/// Notices a camera that goes on sending one and the same picture, bit for bit. Real pictures of a
/// scene at rest differ by their noise; noiseless ones do no harm while nothing moves. One per
/// camera, one thread.
class FrozenPicture {
 public:
  /// @param q  joints at the picture's exposure, radians
  PictureChange look(const Image& image, const Eigen::VectorXd& q);

 private:
  std::uint64_t digest_ = 0;
  Eigen::VectorXd q_;
  PictureChange change_;
};

}  // namespace bodyschema
