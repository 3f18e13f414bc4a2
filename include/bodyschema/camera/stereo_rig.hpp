#pragma once

#include <array>
#include <string>
#include <vector>

#include "bodyschema/core/configuration.hpp"
#include "bodyschema/geometry/binary_mask.hpp"
#include "bodyschema/geometry/image.hpp"
#include "bodyschema/geometry/pinhole.hpp"

namespace bodyschema {

/// One eye: where it sits on the robot and how it maps directions to pixels. The link's frame must
/// have OpenCV axes (x right, y down, z forward).
struct CameraModel {
  std::string name;                    ///< "left", "right"
  std::string link;                    ///< URDF link with OpenCV axes
  PinholeIntrinsics intrinsics;        ///< px
  std::array<double, 5> distortion{};  ///< k1 k2 p1 p2 k3 as OpenCV; all zero: none
  [[nodiscard]] bool has_distortion() const;
};

/// One camera (mono) or two, left first.
struct StereoRig {
  std::vector<CameraModel> cameras;
  /// Reads the `cameras` section. Throws ConfigurationError.
  static StereoRig from(const Configuration& cameras);
  [[nodiscard]] std::vector<PinholeIntrinsics> intrinsics() const;
};

/// Straightens pictures of a distorted camera to its own pinhole intrinsics (bilinear); a copy when there
/// is no distortion. Where the camera did not look, see valid(), the picture is mirrored at its border: colours
/// and noise there are those of what lies beside. Maps are computed once.
class Undistorter {
 public:
  explicit Undistorter(const CameraModel& camera);
  /// Throws DataError when the picture's size is not the camera's.
  [[nodiscard]] Image apply(const Image& image) const;
  /// The pixels of a straightened picture that the camera did see.
  [[nodiscard]] BinaryMask valid() const;

 private:
  CameraModel camera_;
  std::vector<float> map_x_, map_y_;
};

}  // namespace bodyschema
