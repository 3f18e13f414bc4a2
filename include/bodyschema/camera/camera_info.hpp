#pragma once

#include <array>
#include <filesystem>
#include <string>

#include "bodyschema/core/configuration.hpp"
#include "bodyschema/geometry/pinhole.hpp"
#include "bodyschema/geometry/pose.hpp"

namespace bodyschema {

/// What a ROS CameraInfo says of one camera.
struct CameraInfo {
  PinholeIntrinsics intrinsics;                     ///< of the picture as it is taken: K
  std::array<double, 5> distortion{};               ///< D as k1 k2 p1 p2 k3
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();  ///< turns the camera's axes to those of its rectified picture
  PinholeIntrinsics rectified;                      ///< of the rectified picture: P
  double baseline_m = 0.0;  ///< by P: the camera lies so far to the right of the one it is rectified with

  /// Whether rectifying would change the picture.
  [[nodiscard]] bool is_rectified() const;

  /// Reads a YAML file as `ros2 topic echo` prints the message (k, d, r, p, or K, D, R, P) or as ROS's calibration
  /// writes it (camera_matrix, distortion_coefficients, ...). Throws ConfigurationError naming file, key and what was
  /// expected, FileError for a lens that five coefficients do not describe (fisheye, or k4 to k6 that are not 0).
  static CameraInfo read(const std::filesystem::path& file);
  /// The same for what is read already. @param where  begins the error about a lens
  static CameraInfo from(const Configuration& file, const std::string& where);
};

/// Where a camera sits in the frame of the one it was calibrated with as a stereo pair (OpenCV axes); identity where
/// `right` says nothing of a pair. @param rectified  of the frames of the rectified pictures, else of those as taken
[[nodiscard]] Pose stereo_pose(const CameraInfo& left, const CameraInfo& right, bool rectified);

}  // namespace bodyschema
