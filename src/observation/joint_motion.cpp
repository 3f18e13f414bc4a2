#include "bodyschema/observation/joint_motion.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>

namespace bodyschema {
namespace {

/// Half the window: as short as holds enough samples.
constexpr std::array<Microseconds, 3> kHalfWindows = {60'000, 125'000, 250'000};
constexpr std::size_t kForParabola = 5;
/// No arm changes its speed faster than this; on top come the steps of coarse encoders and of joints that
/// are published in turns (the others then repeat their last value).
constexpr double kMostAcceleration_rad_s2 = 50.0;
constexpr double kSteps_rad = 0.02;

std::span<const JointSample> between(std::span<const JointSample> ordered, Microseconds from, Microseconds to) {
  const auto first = std::lower_bound(ordered.begin(), ordered.end(), from,
                                      [](const JointSample& s, Microseconds t) { return s.utime < t; });
  const auto last = std::upper_bound(first, ordered.end(), to,
                                     [](Microseconds t, const JointSample& s) { return t < s.utime; });
  return {first, last};
}

std::span<const JointSample> window(std::span<const JointSample> ordered, Microseconds utime,
                                    Microseconds half) {
  const Microseconds newest = ordered.empty() ? utime : ordered.back().utime;
  const Microseconds after = std::clamp<Microseconds>(newest - utime, 0, half);
  return between(ordered, utime + after - 2 * half, utime + after);
}

bool jumps(std::span<const JointSample> near, Eigen::Index joint) {
  for (std::size_t i = 1; i + 1 < near.size(); ++i) {
    const double before_s = seconds(near[i].utime - near[i - 1].utime);
    const double after_s = seconds(near[i + 1].utime - near[i].utime);
    if (before_s <= 0.0 || after_s <= 0.0) continue;
    const double step_s = std::min(before_s, after_s);
    const double change = (near[i + 1].q[joint] - near[i].q[joint]) / after_s -
                          (near[i].q[joint] - near[i - 1].q[joint]) / before_s;
    if (std::abs(change) * step_s > kSteps_rad + kMostAcceleration_rad_s2 * step_s * step_s) return true;
  }
  return false;
}

}  // namespace

void joint_motion(std::span<const JointSample> ordered, Microseconds utime, Eigen::VectorXd& qdot,
                  Eigen::VectorXd& qddot) {
  const Eigen::Index joints = ordered.empty() ? qdot.size() : ordered.front().q.size();
  qdot.setZero(joints);
  qddot.setZero(joints);
  std::span<const JointSample> near;
  for (const auto half : kHalfWindows) {
    near = window(ordered, utime, half);
    if (near.size() >= kForParabola) break;
  }
  if (near.size() < 2) return;

  // Normal equations of c0 + c1 t + c2 t^2, with t in units of the window, alike for all joints.
  const Eigen::Index terms = near.size() < kForParabola ? 2 : 3;
  const double unit_s = seconds(std::max<Microseconds>(near.back().utime - near.front().utime, 1));
  Eigen::Matrix3d moments = Eigen::Matrix3d::Identity();
  moments.topLeftCorner(terms, terms).setZero();
  const auto powers = [&](const JointSample& sample) {
    const double t = seconds(sample.utime - utime) / unit_s;
    return Eigen::Vector3d(1.0, t, terms == 3 ? t * t : 0.0);
  };
  for (const auto& sample : near) {
    const Eigen::Vector3d p = powers(sample);
    moments.noalias() += p * p.transpose();
  }
  const Eigen::Matrix3d inverse = moments.inverse();
  for (Eigen::Index j = 0; j < joints; ++j) {
    if (jumps(near, j)) continue;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const auto& sample : near) sum += powers(sample) * (sample.q[j] - near.front().q[j]);
    const Eigen::Vector3d c = inverse * sum;
    qdot[j] = c[1] / unit_s;
    if (terms == 3) qddot[j] = 2.0 * c[2] / (unit_s * unit_s);
  }
}

}  // namespace bodyschema
