#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "bodyschema/geometry/image.hpp"

namespace bodyschema {

/// Notices a camera that goes on sending one and the same picture, bit for bit. Real pictures of a
/// scene at rest differ by their noise; noiseless ones do no harm while nothing moves. One per
/// camera, one thread.
class FrozenPicture {
 public:
  /// @param q  joints at the picture's exposure, radians
  void look(const Image& image, const Eigen::VectorXd& q);
  /// Whether the last picture was the same as the one before.
  [[nodiscard]] bool repeated() const { return repeated_; }
  /// The furthest that any joint has moved since the first of these pictures, radians.
  [[nodiscard]] double moved_rad() const { return moved_rad_; }

 private:
  bool first_ = true;
  bool repeated_ = false;
  std::uint64_t digest_ = 0;
  Eigen::VectorXd q_;
  double moved_rad_ = 0.0;
};

}  // namespace bodyschema
