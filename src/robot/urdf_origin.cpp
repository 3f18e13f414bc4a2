#include "bodyschema/robot/urdf_origin.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <iomanip>
#include <locale>
#include <sstream>

namespace bodyschema {

Eigen::Vector3d urdf_triple(const char* text, const Eigen::Vector3d& fallback) {
  if (text == nullptr) return fallback;
  Eigen::Vector3d v = fallback;
  std::istringstream stream(text);
  stream.imbue(std::locale::classic());
  stream >> v.x() >> v.y() >> v.z();
  return v;
}

std::string urdf_text(const Eigen::Vector3d& v) {
  std::ostringstream stream;
  stream.imbue(std::locale::classic());
  stream << std::setprecision(12) << v.x() << ' ' << v.y() << ' ' << v.z();
  return stream.str();
}

Eigen::Matrix3d urdf_rotation(const Eigen::Vector3d& rpy) {
  return (Eigen::AngleAxisd(rpy.z(), Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(rpy.y(), Eigen::Vector3d::UnitY()) *
          Eigen::AngleAxisd(rpy.x(), Eigen::Vector3d::UnitX()))
      .toRotationMatrix();
}

Eigen::Vector3d urdf_rpy(const Eigen::Matrix3d& R) {
  const double pitch = std::atan2(-R(2, 0), std::hypot(R(0, 0), R(1, 0)));
  if (std::hypot(R(0, 0), R(1, 0)) < 1e-9) return {std::atan2(-R(1, 2), R(1, 1)), pitch, 0.0};
  return {std::atan2(R(2, 1), R(2, 2)), pitch, std::atan2(R(1, 0), R(0, 0))};
}

}  // namespace bodyschema
