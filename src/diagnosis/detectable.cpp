#include "bodyschema/diagnosis/detectable.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

namespace bodyschema {
namespace {

constexpr std::size_t kArm = 7;
constexpr std::size_t kHead = 4;

/// Shoulder to wrist.
const std::map<std::string, std::array<double, kArm>>& of_arm() {
  static const std::map<std::string, std::array<double, kArm>> sizes = {
      {"compliance", {0.1, 0.1, 0.3, 0.6, 0, 0, 0}},
      {"backlash", {0.1, 0.15, 0.2, 0.2, 0.4, 0.3, 0.3}},
      {"encoder_gain", {0.5, 0.6, 0.8, 0.8, 1.2, 2.0, 2.0}},
      {"eccentricity", {0.3, 0.35, 0.45, 0.45, 0.7, 1.15, 1.15}},
      {"joint_coupling", {0.5, 0.6, 0.7, 0.7, 1.2, 1.8, 1.8}},
      {"link_length", {0, 0, 1.0, 0, 1.0, 0, 0}},
      {"axis_tilt", {0.3, 0.35, 0.4, 0.4, 0.7, 1.0, 1.0}},
      {"drift", {0.2, 0.2, 0.25, 0.25, 0.4, 0.35, 0.35}},
      {"slip", {0.2, 0.2, 0.3, 0.3, 0.8, 0.6, 0.6}},
      {"wobble", {0.2, 0.2, 0.2, 0.2, 0.4, 0.35, 0.35}},
      {"velocity_lag", {10, 10, 12, 12, 25, 20, 20}},
      {"acceleration_lag", {0.2, 0.2, 0.25, 0.25, 0.5, 0.4, 0.4}},
      {"local_kink", {0.3, 0.3, 0.3, 0.3, 0.6, 0.5, 0.5}},
      {"random_walk", {0.3, 0.3, 0.3, 0.3, 0.6, 0.5, 0.5}}};
  return sizes;
}

const std::map<std::string, double>& of_robot() {
  static const std::map<std::string, double> sizes = {
      {"payload", 0.25},         {"latency", 5.0},       {"camera_skew", 5.6},     {"vergence", 0.09},
      {"baseline", 0.4},         {"focal_length", 0.55}, {"principal_point", 0.4}, {"distortion", 0.026},
      {"silhouette_bias", 0.23}, {"mesh_scale", 0.6},    {"finger_posture", 0.1}};
  return sizes;
}

/// Neck pitch, roll, yaw, eyes' tilt.
constexpr std::array<double, kHead> kOfHead = {0.3, 0.2, 0.3, 0.4};

/// Position of a joint among its kind, on a robot that has `count` of them; none if it is not of the kind.
std::size_t position_in(const std::vector<Eigen::Index>& kind, const std::string& joint, const JointRoles& roles,
                        std::size_t count) {
  for (std::size_t i = 0; i < kind.size(); ++i) {
    if (roles.names[static_cast<std::size_t>(kind[i])] != joint) continue;
    if (kind.size() == count || kind.size() < 2) return std::min(i, count - 1);
    const double out = static_cast<double>(i) / static_cast<double>(kind.size() - 1);
    return static_cast<std::size_t>(std::lround(out * static_cast<double>(count - 1)));
  }
  return count;
}

}  // namespace

double detectable_size(const std::string& name, const EffectTarget& target, const JointRoles& roles) {
  if (const auto at = of_robot().find(name); at != of_robot().end()) return at->second;
  if (name == "head_offset") {
    const auto i = position_in(roles.neck, target.joint, roles, kHead);
    return i < kHead ? kOfHead[i] : 0.0;
  }
  const auto at = of_arm().find(name);
  if (at == of_arm().end()) return 0.0;
  const auto i = position_in(roles.arm, target.joint, roles, kArm);
  return i < kArm ? at->second[i] : 0.0;
}

}  // namespace bodyschema
