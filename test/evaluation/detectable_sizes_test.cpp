#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "bodyschema/core/configuration.hpp"
#include "bodyschema/diagnosis_trials/trials.hpp"
#include "bodyschema/simulator/simulator.hpp"

namespace bodyschema {
namespace {

std::string argument(const simulator::FaultSpec& spec, const char* key) {
  const auto found = spec.arguments.find(key);
  return found == spec.arguments.end() ? "" : found->second;
}

/// Simulator and diagnosis know nothing of each other, so each has its own table of the smallest sizes
/// that can be found; what the rates and the hidden effects call five times as large must be the same.
TEST(DetectableSizes, AreTheSameForTrialsAndSimulator) {
  const auto file = std::filesystem::path(BODYSCHEMA_SOURCE_DIR) / "config/icub_right/simulator.yaml";
  const auto configuration = Configuration::load(file);
  TrialRobot robot;
  robot.setup = RobotSetup::from(configuration.section("robot"));
  robot.rig = StereoRig::from(configuration.section("cameras"));
  robot.model = robot.setup.load();
  const simulator::FaultSite site(robot.model, robot.setup, robot.rig);
  int compared = 0;
  for (const bool outside : {false, true}) {
    for (const auto& fault : trial_faults(robot, outside)) {
      const auto targets = simulator::fault_kind(fault.cause.name).targets(site);
      const auto same = std::find_if(targets.begin(), targets.end(), [&](const auto& target) {
        return argument(target.spec, "joint") == fault.cause.joint &&
               (argument(target.spec, "source") == fault.cause.source || fault.cause.source.empty());
      });
      if (same == targets.end()) continue;  // the simulator draws fewer places
      EXPECT_DOUBLE_EQ(same->detectable, fault.detectable) << fault.cause.text();
      ++compared;
    }
  }
  EXPECT_GE(compared, 80);
}

}  // namespace
}  // namespace bodyschema
