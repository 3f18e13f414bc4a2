#include "bodyschema/diagnosis/log_testability.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <spdlog/fmt/fmt.h>

#include "bodyschema/bus/log.hpp"
#include "bodyschema/bus/observation_stream.hpp"
#include "bodyschema/core/error.hpp"
#include "bodyschema/core/progress_bar.hpp"
#include "bodyschema/diagnosis/log_diagnosis.hpp"
#include "bodyschema/pipeline/joint_stream.hpp"
#include "bodyschema/pipeline/watched_log.hpp"
#include "log_exposures.hpp"
#include "log_length.hpp"
#include "log_motion.hpp"

namespace bodyschema {
namespace {

std::string joints_text(const std::set<std::string>& joints, const std::vector<std::string>& arm) {
  if (joints.empty()) return "";
  const bool whole = std::all_of(arm.begin(), arm.end(), [&](const auto& name) { return joints.contains(name); });
  return whole && joints.size() == arm.size() ? " of every arm joint" : fmt::format(" of {}", fmt::join(joints, ", "));
}

}  // namespace

LogTestability testability_of(const Configuration& configuration, const std::filesystem::path& log) {
  auto setup = RobotSetup::from(configuration.section("robot"));
  const auto rig = StereoRig::from(configuration.section("cameras"));
  const auto bus = BusOptions::from(configuration.section("bus"));
  configuration.reject_unknown_sections();
  configuration.section("robot").leave_to_others("tolerances");
  for (const char* read : {"robot", "cameras", "bus"}) configuration.section(read).reject_unknown_keys();
  const auto model = load_robot(setup, rig);
  const auto roles = JointRoles::of(model, setup, rig);
  ObservationStream stream(model, setup, rig, bus);
  ProgressBar bar("motion", LogReader(log).size());
  const auto [pictures, cameras, encoders] =
      diagnosis::LogExposures::read(log, stream, JointStream(*model, setup, bus), LogDiagnosisOptions{}.picture_rate_hz,
                                    [&](const auto&, auto position) {
                                      bar.set(position);
                                      return true;
                                    });
  if (pictures.empty()) {
    const auto why = why_no_picture(stream.statistics(), rig, stream.channels());
    if (!why.empty()) throw DataError(log.string() + ": " + why);
    throw DataError(fmt::format("{}: no pictures with encoders on {} and {}", log.string(), stream.channels().cameras,
                                stream.channels().joint_state));
  }
  LogTestability result;
  result.duration_s = seconds(pictures.back().utime - pictures.front().utime);
  result.pictures = pictures.size();
  for (const auto joint : roles.arm) {
    result.arm_joints.push_back(roles.names[static_cast<std::size_t>(joint)]);
  }
  result.not_testable =
      diagnosis::untestable(roles, diagnosis::log_motion(pictures, cameras, encoders, model, setup, roles));
  result.refusal = diagnosis::why_too_short(diagnosis::log_length(pictures, roles, {}), result.not_testable, roles, {});
  for (const auto& kind : effect_kinds()) {
    const auto& name = kind.get().name;
    if (name == "joint_offset" || kind.get().where_believed) continue;  // never a finding
    for (const auto& target : kind.get().targets(roles)) {
      const CauseName cause{name, target.joint, target.source};
      const bool refused = std::any_of(result.not_testable.begin(), result.not_testable.end(),
                                       [&](const auto& n) { return n.cause == cause; });
      if (!refused) result.testable.push_back(cause);
    }
  }
  return result;
}

std::string LogTestability::text() const {
  if (!refusal.empty()) return refusal + '\n';
  std::string out =
      fmt::format("a diagnosis would use {:.1f} s and {} pictures of this log and could test\n", duration_s, pictures);
  std::map<std::string, std::set<std::string>> by_cause;
  for (const auto& cause : testable) {
    auto& on = by_cause[cause.name];
    // A pair or a camera does not help to decide what to move.
    if (!cause.joint.empty() && cause.source.empty()) on.insert(cause.joint);
  }
  for (const auto& [name, on] : by_cause) out += "  " + name + joints_text(on, arm_joints) + '\n';
  std::map<std::string, std::set<std::string>> by_reason;
  for (const auto& item : not_testable) by_reason[item.reason].insert(item.cause.name);
  if (!by_reason.empty()) out += "but not\n";
  for (const auto& [reason, names] : by_reason) out += fmt::format("  {}: {}\n", fmt::join(names, ", "), reason);
  return out;
}

}  // namespace bodyschema
