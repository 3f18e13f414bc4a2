#pragma once

#include <cstdlib>
#include <iostream>
#include <random>
#include <string>

#include "bodyschema/core/configuration.hpp"
#include "bodyschema/diagnosis_trials/trials.hpp"

namespace bodyschema::test {

/// This project's own robot.
inline const TrialRobot& robot() {
  static const TrialRobot shared = [] {
    const auto configuration =
        Configuration::load(std::string(BODYSCHEMA_SOURCE_DIR) + "/config/icub_right/robot.yaml");
    TrialRobot r;
    r.setup = RobotSetup::from(configuration.section("robot"));
    r.rig = StereoRig::from(configuration.section("cameras"));
    r.model = r.setup.load();
    return r;
  }();
  return shared;
}

/// A fresh seed each run, or BODYSCHEMA_SEED; printed, so that a failure can be repeated.
inline std::uint64_t seed() {
  static const std::uint64_t value = [] {
    const char* given = std::getenv("BODYSCHEMA_SEED");
    const std::uint64_t s = given ? std::strtoull(given, nullptr, 10) : std::random_device{}();
    std::cout << "BODYSCHEMA_SEED=" << s << std::endl;
    return s;
  }();
  return value;
}

/// For single logs, each of which may go wrong now and then at the demanded rates: the same log each
/// run, or BODYSCHEMA_SEED.
inline std::uint64_t log_seed() {
  return std::getenv("BODYSCHEMA_SEED") ? seed() : 1;
}

inline DiagnosisOptions usual_options(const MeasurementSource& source) {
  DiagnosisOptions options;
  options.nuisances = usual_nuisances(source.roles());
  return options;
}

}  // namespace bodyschema::test
