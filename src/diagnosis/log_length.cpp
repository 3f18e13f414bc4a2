#include "log_length.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <map>

#include "limits.hpp"

namespace bodyschema::diagnosis {
namespace {

Eigen::VectorXd of_arm(const Eigen::VectorXd& joints, const JointRoles& roles) {
  Eigen::VectorXd arm = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(roles.arm.size()));
  for (std::size_t i = 0; i < roles.arm.size(); ++i) {
    if (roles.arm[i] < joints.size()) arm[static_cast<Eigen::Index>(i)] = joints[roles.arm[i]];
  }
  return arm;
}

double apart(const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
  return a.size() == 0 ? 0.0 : (a - b).cwiseAbs().maxCoeff();
}

}  // namespace

LogLength log_length(std::span<const JointSample> pictures, const JointRoles& roles, const DiagnosisOptions& options) {
  LogLength length;
  std::vector<Eigen::VectorXd> held;
  Eigen::VectorXd first, last;
  bool last_still = false;
  Microseconds last_utime = 0;
  for (const auto& picture : pictures) {
    const auto q = of_arm(picture.q, roles);
    const auto speed = of_arm(picture.qdot, roles);
    const bool still = speed.size() == 0 || speed.cwiseAbs().maxCoeff() < options.same_posture_rad;
    if (first.size() == 0) {
      first = q;
    } else if (!(still && last_still && apart(q, last) > limits::kJump_rad)) {
      length.seconds += seconds(picture.utime - last_utime);
    }
    length.moved_rad = std::max(length.moved_rad, apart(q, first));
    const auto same = [&](const Eigen::VectorXd& other) { return apart(q, other) < options.same_posture_rad; };
    if (still && held.size() < options.fewest_postures && std::none_of(held.begin(), held.end(), same))
      held.push_back(q);
    last = q;
    last_still = still;
    last_utime = picture.utime;
  }
  length.postures = held.size();
  return length;
}

std::string why_too_short(const LogLength& length, const std::vector<NotTestable>& not_testable,
                          const JointRoles& roles, const DiagnosisOptions& options) {
  if (length.moved_rad < options.same_posture_rad) {
    return "the arm stands still in every picture; move it through its range while recording";
  }
  if (length.seconds >= options.shortest_log_s || length.postures >= options.fewest_postures) return "";
  std::map<std::string, std::size_t> refused;
  for (const auto& item : not_testable) ++refused[item.cause.name];
  std::vector<std::string> untested;
  for (const auto& [name, targets] : refused) {
    if (targets == effect_targets(name, roles).size()) untested.push_back(name);
  }
  const std::string besides =
      untested.empty() ? "" : fmt::format("; this motion leaves untested besides: {}", fmt::join(untested, ", "));
  return fmt::format(
      "too short for a diagnosis: {:.1f} s of pictures; record {:.0f} s in motion, better 60 s, or {} distinct "
      "postures held still, of which it has {}{}",
      length.seconds, options.shortest_log_s, options.fewest_postures, length.postures, besides);
}

}  // namespace bodyschema::diagnosis
