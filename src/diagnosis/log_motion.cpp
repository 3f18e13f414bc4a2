#include "log_motion.hpp"

#include <algorithm>
#include <cmath>

#include "bodyschema/core/order_statistics.hpp"
#include "bodyschema/geometry/pose.hpp"

namespace bodyschema::diagnosis {
namespace {

/// How often the arm's joints come: messages of head and arm may come at different rates, and a joint says something
/// new only when it moves. The quicker quarter of the times between changes; the mean period of all messages while
/// nothing changes.
void find_readings(std::span<const JointSample> encoders, const JointRoles& roles, LogMotion& motion) {
  constexpr std::size_t kFewest = 4;
  motion.reading_period_s = 1e9;
  if (encoders.size() < 2) return;
  std::vector<double> periods, steps;
  std::size_t last = 0;
  for (std::size_t i = 1; i < encoders.size(); ++i) {
    double step = 0.0;
    for (const auto joint : roles.arm) step = std::max(step, std::abs(encoders[i].q[joint] - encoders[last].q[joint]));
    if (step == 0.0) continue;
    periods.push_back(seconds(encoders[i].utime - encoders[last].utime));
    steps.push_back(step);
    last = i;
  }
  if (periods.size() < kFewest) {
    motion.reading_period_s =
        seconds(encoders.back().utime - encoders.front().utime) / static_cast<double>(encoders.size() - 1);
    return;
  }
  motion.reading_period_s = quantile(periods, 0.25);
  motion.reading_step_rad = quantile(steps, 0.5);
}

/// How often a joint turns round; turning points at least half a degree apart, so that encoder noise is none.
int turning_points(std::span<const JointSample> encoders, Eigen::Index joint) {
  constexpr double kReversal = 0.5 * kPi / 180.0;
  double extreme = encoders.empty() ? 0.0 : encoders.front().q[joint];
  int count = 0, direction = 0;
  for (const auto& sample : encoders) {
    const double q = sample.q[joint];
    if (direction >= 0 && q < extreme - kReversal) {
      count += direction > 0;
      direction = -1;
      extreme = q;
    } else if (direction <= 0 && q > extreme + kReversal) {
      count += direction < 0;
      direction = 1;
      extreme = q;
    } else if ((direction > 0 && q > extreme) || (direction < 0 && q < extreme)) {
      extreme = q;
    }
  }
  return count;
}

}  // namespace

LogMotion log_motion(std::span<const JointSample> pictures, std::size_t cameras, std::span<const JointSample> encoders,
                     const std::shared_ptr<const RobotModel>& robot, const RobotSetup& setup, const JointRoles& roles) {
  const auto n = robot->joint_count();
  LogMotion motion;
  motion.cameras = cameras;
  motion.range_rad = motion.torque_range_nm = Eigen::VectorXd::Zero(n);
  InstantBuilder instants(robot, setup.hand_link, setup.gravity_W);
  Eigen::VectorXd low = Eigen::VectorXd::Constant(n, 1e9), high = -low, torque_low = low, torque_high = high;
  double square = 0.0;
  Instant at;
  for (const auto& sample : pictures) {
    low = low.cwiseMin(sample.q);
    high = high.cwiseMax(sample.q);
    for (const auto joint : roles.arm) square += sample.qdot.size() > joint ? std::pow(sample.qdot[joint], 2) : 0.0;
    instants.build(sample, 0, Eigen::VectorXd::Zero(n), at);
    motion.has_masses = at.gravity_torque.size() > 0;
    if (!motion.has_masses) continue;
    torque_low = torque_low.cwiseMin(at.gravity_torque);
    torque_high = torque_high.cwiseMax(at.gravity_torque);
  }
  if (!pictures.empty()) {
    motion.range_rad = high - low;
    if (motion.has_masses) motion.torque_range_nm = torque_high - torque_low;
    motion.arm_speed_rad_s = std::sqrt(square / static_cast<double>(pictures.size()));
  }
  for (Eigen::Index j = 0; j < n; ++j) motion.reversals.push_back(turning_points(encoders, j));
  for (const auto joint : roles.neck) motion.neck_range_rad = std::max(motion.neck_range_rad, motion.range_rad[joint]);
  find_readings(encoders, roles, motion);
  return motion;
}

std::vector<NotTestable> untestable(const JointRoles& roles, const LogMotion& motion) {
  std::vector<NotTestable> list;
  for (const auto& kind : effect_kinds()) {
    if (!kind.get().not_testable) continue;
    for (const auto& target : kind.get().targets(roles)) {
      if (auto why = kind.get().not_testable(target, roles, motion); !why.empty()) {
        list.push_back({{kind.get().name, target.joint, target.source}, std::move(why)});
      }
    }
  }
  return list;
}

}  // namespace bodyschema::diagnosis
