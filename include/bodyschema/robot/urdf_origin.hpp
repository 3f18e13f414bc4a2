#pragma once

#include <Eigen/Core>
#include <string>

namespace bodyschema {

/// Numbers of a URDF's `xyz`, `rpy` and `axis` attributes, to and from text, whatever the locale.

/// Three numbers; `fallback` for a null pointer and for numbers that are missing at the end.
Eigen::Vector3d urdf_triple(const char* text, const Eigen::Vector3d& fallback = Eigen::Vector3d::Zero());
/// Twelve digits each.
std::string urdf_text(const Eigen::Vector3d& v);
/// Fixed-axis roll, pitch, yaw: R = Rz(yaw) Ry(pitch) Rx(roll).
Eigen::Matrix3d urdf_rotation(const Eigen::Vector3d& rpy);
/// The inverse of urdf_rotation; where roll and yaw turn about the same line, roll takes all.
Eigen::Vector3d urdf_rpy(const Eigen::Matrix3d& R);

}  // namespace bodyschema
