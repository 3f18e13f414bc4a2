#pragma once

#include <Eigen/Geometry>
#include <cmath>

namespace bodyschema {

/// A rigid transform. `X_AB` is the pose of frame B in frame A and maps coordinates in B to
/// coordinates in A: `p_A = X_AB * p_B`. Metres, right-handed.
///
/// Frame letters used throughout: W robot root, H head, L and R left and right camera, P palm
/// (hand base, iKin end-effector), C any camera, B any body part.
/// Camera frames have OpenCV axes: x right, y down, z forward.
using Pose = Eigen::Isometry3d;

inline Eigen::Matrix3d skew(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

/// Angle in radians of the rotation that takes one orientation to the other:
/// sqrt(|log(R_a' R_b)|_F^2 / 2), the paper's equation (8) before conversion to degrees.
inline double rotation_distance(const Eigen::Matrix3d& R_a, const Eigen::Matrix3d& R_b) {
  const Eigen::Quaterniond q(R_a.transpose() * R_b);
  return 2.0 * std::atan2(q.vec().norm(), std::abs(q.w()));
}

constexpr double kPi = 3.14159265358979323846;
constexpr double radians(double degrees) {
  return degrees * (kPi / 180.0);
}
constexpr double degrees(double radians) {
  return radians * (180.0 / kPi);
}

}  // namespace bodyschema
