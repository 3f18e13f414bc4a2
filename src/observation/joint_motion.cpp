#include "bodyschema/observation/joint_motion.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace bodyschema {
namespace {

/// Half the window: as short as holds enough samples.
constexpr std::array<Microseconds, 3> kHalfWindows = {60'000, 125'000, 250'000};
constexpr std::size_t kForParabola = 5;
/// Half the window of accelerations, where the samples after the instant reach as far: over 60 ms the steps
/// of a 12-bit encoder alone look like 11 deg/s^2, which is more than slow motion has; and what is made of
/// the encoder's error seems to explain that error in the pictures.
constexpr Microseconds kHalfForAcceleration = 150'000;
/// Half the window of each point of a path. A coarse encoder's steps are as much of slow motion's speed, and what is
/// noise in the speed makes a delay shorter than it is.
constexpr Microseconds kHalfOfPath = 125'000;
/// No arm changes its speed faster than this; on top come the steps of coarse encoders and of joints that
/// are published in turns (the others then repeat their last value).
constexpr double kMostAcceleration_rad_s2 = 50.0;
constexpr double kSteps_rad = 0.02;

std::span<const JointSample> between(std::span<const JointSample> ordered, Microseconds from, Microseconds to) {
  const auto first = std::lower_bound(ordered.begin(), ordered.end(), from,
                                      [](const JointSample& s, Microseconds t) { return s.utime < t; });
  const auto last =
      std::upper_bound(first, ordered.end(), to, [](Microseconds t, const JointSample& s) { return t < s.utime; });
  return {first, last};
}

std::span<const JointSample> window(std::span<const JointSample> ordered, Microseconds utime, Microseconds half) {
  const Microseconds newest = ordered.empty() ? utime : ordered.back().utime;
  const Microseconds after = std::clamp<Microseconds>(newest - utime, 0, half);
  return between(ordered, utime + after - 2 * half, utime + after);
}

/// Whether a joint jumps about a sample that is neither the first nor the last.
bool jumps_at(std::span<const JointSample> near, std::size_t i, Eigen::Index joint) {
  const double before_s = seconds(near[i].utime - near[i - 1].utime);
  const double after_s = seconds(near[i + 1].utime - near[i].utime);
  if (before_s <= 0.0 || after_s <= 0.0) return false;
  const double step_s = std::min(before_s, after_s);
  const double change =
      (near[i + 1].q[joint] - near[i].q[joint]) / after_s - (near[i].q[joint] - near[i - 1].q[joint]) / before_s;
  return std::abs(change) * step_s > kSteps_rad + kMostAcceleration_rad_s2 * step_s * step_s;
}

bool jumps(std::span<const JointSample> near, Eigen::Index joint) {
  for (std::size_t i = 1; i + 1 < near.size(); ++i) {
    if (jumps_at(near, i, joint)) return true;
  }
  return false;
}

/// The last sample before an instant at which a joint jumps, and the first from it on.
std::pair<Microseconds, Microseconds> nearest_jumps(std::span<const JointSample> near, Microseconds utime,
                                                    Eigen::Index joint) {
  std::pair nearest(std::numeric_limits<Microseconds>::min(), std::numeric_limits<Microseconds>::max());
  for (std::size_t i = 1; i + 1 < near.size(); ++i) {
    if (!jumps_at(near, i, joint)) continue;
    if (near[i].utime < utime) nearest.first = near[i].utime;
    if (near[i].utime >= utime) nearest.second = std::min(nearest.second, near[i].utime);
  }
  return nearest;
}

/// Least squares of c0 + c1 t + c2 t^2 (or without c2), t from an instant on in units of the window.
class Parabola {
 public:
  Parabola(std::span<const JointSample> near, Microseconds utime)
      : near_(near), utime_(utime), terms_(near.size() < kForParabola ? 2 : 3),
        unit_s_(seconds(std::max<Microseconds>(near.back().utime - near.front().utime, 1))) {
    // Normal equations, alike for all joints.
    Eigen::Matrix3d moments = Eigen::Matrix3d::Identity();
    moments.topLeftCorner(terms_, terms_).setZero();
    for (const auto& sample : near_) {
      const Eigen::Vector3d p = powers(sample);
      moments.noalias() += p * p.transpose();
    }
    inverse_ = moments.inverse();
  }

  /// Where all joints are at the instant.
  void positions(Eigen::Ref<Eigen::VectorXd> q) const {
    q = near_.front().q;
    for (const auto& sample : near_) {
      const double weight = inverse_.row(0).dot(powers(sample));
      q += weight * (sample.q - near_.front().q);
    }
  }

  struct Motion {
    double velocity = 0.0, acceleration = 0.0;
  };
  /// Still, for a joint that jumps.
  [[nodiscard]] Motion of(Eigen::Index joint) const {
    if (jumps(near_, joint)) return {};
    const Eigen::Vector3d c = fitted(joint);
    return {c[1] / unit_s_, terms_ == 3 ? 2.0 * c[2] / (unit_s_ * unit_s_) : 0.0};
  }

 private:
  [[nodiscard]] Eigen::Vector3d fitted(Eigen::Index joint) const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const auto& sample : near_) sum += powers(sample) * (sample.q[joint] - near_.front().q[joint]);
    return inverse_ * sum;
  }
  [[nodiscard]] Eigen::Vector3d powers(const JointSample& sample) const {
    const double t = seconds(sample.utime - utime_) / unit_s_;
    return {1.0, t, terms_ == 3 ? t * t : 0.0};
  }

  std::span<const JointSample> near_;
  Microseconds utime_;
  Eigen::Index terms_;
  double unit_s_;
  Eigen::Matrix3d inverse_;
};

}  // namespace

void joint_motion(std::span<const JointSample> ordered, Microseconds utime, Eigen::VectorXd& qdot,
                  Eigen::VectorXd& qddot) {
  const Eigen::Index joints = ordered.empty() ? qdot.size() : ordered.front().q.size();
  qdot.setZero(joints);
  qddot.setZero(joints);
  std::span<const JointSample> near;
  Microseconds half = 0;
  for (const auto wider : kHalfWindows) {
    half = wider;
    near = window(ordered, utime, half);
    if (near.size() >= kForParabola) break;
  }
  if (near.size() < 2) return;
  const Parabola narrow(near, utime);
  for (Eigen::Index j = 0; j < joints; ++j) qdot[j] = narrow.of(j).velocity;

  const Microseconds known = std::min(ordered.back().utime - utime, utime - ordered.front().utime);
  const Microseconds half_wide = std::max(half, std::min(known, kHalfForAcceleration));
  const Parabola wide(window(ordered, utime, half_wide), utime);
  for (Eigen::Index j = 0; j < joints; ++j) qddot[j] = wide.of(j).acceleration;
}

void joint_path(std::span<const JointSample> ordered, Microseconds utime, Eigen::MatrixXd& path) {
  constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  const Eigen::Index joints = ordered.empty() ? 0 : ordered.front().q.size();
  path.setConstant(joints, 2 * kPathSteps + 1, kUnknown);
  if (joints == 0) return;
  const Microseconds half = kHalfOfPath;
  for (Eigen::Index step = -kPathSteps; step <= kPathSteps; ++step) {
    const Microseconds at = utime + microseconds(static_cast<double>(step) * kPathStep_s);
    if (at - half < ordered.front().utime || at + half > ordered.back().utime) continue;
    const auto near = between(ordered, at - half, at + half);
    if (near.size() < kForParabola) continue;
    Parabola(near, at).positions(path.col(kPathSteps + step));
  }
  const Microseconds reach = half + microseconds(static_cast<double>(kPathSteps) * kPathStep_s);
  const auto all = between(ordered, utime - reach, utime + reach);
  const Eigen::VectorXd middle = path.col(kPathSteps);
  for (Eigen::Index j = 0; j < joints; ++j) {
    const auto [before, after] = nearest_jumps(all, utime, j);
    for (Eigen::Index step = -kPathSteps; step <= kPathSteps; ++step) {
      const Microseconds at = utime + microseconds(static_cast<double>(step) * kPathStep_s);
      if (at - half <= before || at + half >= after) path(j, kPathSteps + step) = kUnknown;
    }
  }
  path.colwise() -= middle;
}

}  // namespace bodyschema
