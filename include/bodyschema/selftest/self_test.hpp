#pragma once

#include <filesystem>
#include <functional>
#include <string>

namespace bodyschema {

enum class CheckLevel { kOk, kWarn, kFail };
/// "OK", "WARN", "FAIL".
const char* to_string(CheckLevel level);

struct CheckResult {
  CheckLevel level = CheckLevel::kOk;
  std::string name;      ///< one word
  std::string sentence;  ///< what was found, and what to do where that is not good
};

struct SelfTestOptions {
  std::string version;  ///< of this software
  /// The robot that reaches: estimator, robot and simulator sections; below the installed data.
  std::filesystem::path reach_config = "config/icub_right/evaluation.yaml";
  /// A robot's own configuration to be checked as well; empty: none.
  std::filesystem::path own_config;
  std::string lcm_url;  ///< the network whose route and receive buffer are checked
  int frames = 40;      ///< of the simulated reach
};

/// Looks at everything an installation needs to work, in about ten seconds and without a robot:
/// versions, installed files, robot model, OpenGL, silhouette engine, a simulated reach through the
/// whole pipeline, multicast and receive buffer, and messages of a stereo pair's size through LCM
/// (on a port of its own, never leaving the machine). Goes on after a failed check. Does not throw
/// on account of what it checks.
/// @param report  called with each result as it is known
/// @return the worst level
CheckLevel run_self_test(const SelfTestOptions& options, const std::function<void(const CheckResult&)>& report);

}  // namespace bodyschema
