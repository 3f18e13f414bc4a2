#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "bodyschema/core/time.hpp"

namespace bodyschema {

/// A cause found in one log, as its diagnosis wrote it.
struct FleetCause {
  std::string name;  ///< "backlash of r_elbow"
  std::string parameter;
  std::string unit;
  double estimate = 0.0;  ///< in `unit`; NaN where the diagnosis gives none
  std::array<double, 2> ci95{};
};

/// One log of the fleet.
struct FleetLog {
  std::string name;
  Microseconds begin = 0;  ///< us since the Unix epoch
  double duration_s = 0.0;
  std::string verdict;   ///< of the diagnosis; "not diagnosed" where there is none
  std::string sentence;  ///< of the diagnosis, or why there is none
  std::vector<FleetCause> causes;
  std::map<std::string, double> offsets_deg;
  std::map<std::string, std::array<double, 2>> offsets_ci95_deg;  ///< of those the diagnosis gives an interval for
};

/// How one quantity of a robot moved from log to log.
struct FleetTrend {
  std::string name;
  std::string unit;
  std::vector<std::size_t> log;  ///< which of the robot's logs
  std::vector<double> week;      ///< since the robot's first log
  std::vector<double> value;
  double per_week = 0.0;  ///< slope of the straight line through them; 0 for fewer than two
};

/// Offsets of one joint in one log that no common value explains together with those of other logs: their difference is
/// larger than their intervals allow. Either one of the logs misleads its diagnosis, or the robot changed in between.
struct FleetDisagreement {
  std::string log;
  std::string joint;
  double offset_deg = 0.0;
  std::array<double, 2> ci95_deg{};
  double others_deg = 0.0;  ///< median of the other logs
  int with = 0, of = 0;     ///< it disagrees with so many, of so many that give this joint an interval
};

struct FleetRobot {
  std::string name;
  std::vector<FleetLog> logs;       ///< by date
  std::vector<FleetTrend> causes;   ///< most frequent first
  std::vector<FleetTrend> offsets;  ///< by joint
  /// Of each log and joint that disagrees with another log; those that disagree with the largest share come first.
  std::vector<FleetDisagreement> disagreements;
  [[nodiscard]] std::string sentence() const;
};

/// Gathers what the workflow left in `results`: a folder for each robot with a folder for each log,
/// in which info.json (`bodyschema log info --json`), outcome.txt ("diagnosed", or why not) and
/// report.json lie. Robots by name. A report that cannot be read counts as not diagnosed. Throws
/// FileError when there is no result at all.
std::vector<FleetRobot> gather_fleet(const std::filesystem::path& results);

/// Writes one page for people (report.html) and the same for programs (fleet.json) into `out`.
/// Returns a line per robot. Throws as write_file (core/write_file.hpp).
std::string write_fleet_report(const std::vector<FleetRobot>& robots, const std::filesystem::path& out);

}  // namespace bodyschema
