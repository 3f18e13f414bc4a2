#include "bodyschema/fleet/fleet_report.hpp"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <fstream>
#include <limits>
#include <set>
#include <spdlog/fmt/fmt.h>
#include <sstream>

#include <nlohmann/json.hpp>

#include "bodyschema/core/error.hpp"
#include "bodyschema/core/rounded.hpp"
#include "bodyschema/core/write_file.hpp"
#include "bodyschema/evidence/distributions.hpp"
#include "bodyschema/report/report.hpp"

namespace bodyschema {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr double kWeek_s = 7.0 * 24.0 * 3600.0;
constexpr const char* kNotDiagnosed = "not diagnosed";
/// Chance that logs of a robot which has not changed are said to disagree.
constexpr double kFalseAlarm = 0.05;
constexpr double kMoved_deg = 0.3;  ///< an offset that moved by more is worth a word
constexpr std::size_t kMostFileBytes = 64u << 20;

std::string first_line_of(const fs::path& file) {
  std::ifstream stream(file);
  std::string line;
  std::getline(stream, line);
  return line;
}

Json read_json(const fs::path& file) {
  std::error_code error;
  if (fs::file_size(file, error) > kMostFileBytes || error) throw FileError(file.string() + ": missing or too large");
  std::ifstream stream(file);
  try {
    return Json::parse(stream);
  } catch (const Json::exception&) {
    throw FileError(file.string() + ": not valid JSON, was it cut short?");
  }
}

std::string text(const Json& object, const char* key) {
  const auto at = object.find(key);
  return at != object.end() && at->is_string() ? at->get<std::string>() : "";
}

double number(const Json& value) {
  return value.is_number() ? value.get<double>() : std::numeric_limits<double>::quiet_NaN();
}

FleetCause cause_of(const Json& json) {
  FleetCause cause;
  cause.name = text(json, "name");
  if (const auto joint = text(json, "joint"); !joint.empty()) cause.name += " of " + joint;
  if (const auto source = text(json, "source"); !source.empty()) cause.name += " with " + source;
  cause.parameter = text(json, "parameter");
  cause.unit = text(json, "unit");
  cause.estimate = json.contains("estimate") ? number(json["estimate"]) : number(nullptr);
  cause.ci95 = {cause.estimate, cause.estimate};
  if (json.contains("ci95") && json["ci95"].is_array() && json["ci95"].size() == 2) {
    cause.ci95 = {number(json["ci95"][0]), number(json["ci95"][1])};
  }
  return cause;
}

void read_report(const fs::path& file, FleetLog& log) {
  const Json json = read_json(file);
  if (!json.is_object() || text(json, "verdict").empty()) {
    throw FileError(file.string() + ": no 'verdict', expected the report of a diagnosis");
  }
  log.verdict = text(json, "verdict");
  log.sentence = text(json, "sentence");
  if (json.contains("causes") && json["causes"].is_array()) {
    for (const auto& cause : json["causes"]) log.causes.push_back(cause_of(cause));
  }
  if (json.contains("offsets_deg") && json["offsets_deg"].contains("after")) {
    for (const auto& [joint, value] : json["offsets_deg"]["after"].items()) log.offsets_deg[joint] = number(value);
  }
  if (json.contains("offsets_ci95_deg")) {
    for (const auto& [joint, ci] : json["offsets_ci95_deg"].items()) {
      if (ci.is_array() && ci.size() == 2) log.offsets_ci95_deg[joint] = {number(ci[0]), number(ci[1])};
    }
  }
}

FleetLog read_log(const fs::path& folder) {
  FleetLog log;
  log.name = folder.filename().string();
  log.verdict = kNotDiagnosed;
  try {
    const Json info = read_json(folder / "info.json");
    log.begin = info.value("begin_utime", Microseconds{0});
    log.duration_s = info.value("duration_s", 0.0);
    const std::string outcome = first_line_of(folder / "outcome.txt");
    if (outcome == "diagnosed") {
      read_report(folder / "report.json", log);
    } else {
      log.sentence = outcome.empty() ? "the diagnosis has not been run" : outcome;
    }
  } catch (const Error& e) {
    log.sentence = e.what();
  } catch (const Json::exception&) {
    log.sentence = (folder / "info.json").string() + ": not what bodyschema log info --json writes";
  }
  return log;
}

double slope(const std::vector<double>& x, const std::vector<double>& y) {
  double mx = 0.0, my = 0.0, xx = 0.0, xy = 0.0;
  const auto n = static_cast<double>(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) {
    mx += x[i] / n;
    my += y[i] / n;
  }
  for (std::size_t i = 0; i < x.size(); ++i) {
    xx += (x[i] - mx) * (x[i] - mx);
    xy += (x[i] - mx) * (y[i] - my);
  }
  return xx > 0.0 ? xy / xx : 0.0;
}

void find_trends(FleetRobot& robot) {
  if (robot.logs.empty()) return;
  std::map<std::string, FleetTrend> causes, offsets;
  const Microseconds first = robot.logs.front().begin;
  for (std::size_t i = 0; i < robot.logs.size(); ++i) {
    const FleetLog& log = robot.logs[i];
    const auto add = [&](FleetTrend& trend, const std::string& name, const std::string& unit, double value) {
      if (!std::isfinite(value)) return;
      trend.name = name;
      trend.unit = unit;
      trend.log.push_back(i);
      trend.week.push_back(seconds(log.begin - first) / kWeek_s);
      trend.value.push_back(value);
    };
    for (const auto& cause : log.causes) {
      const std::string name = cause.parameter.empty() || cause.name.starts_with(cause.parameter)
                                   ? cause.name
                                   : cause.name + " (" + cause.parameter + ")";
      add(causes[name + cause.unit], name, cause.unit, cause.estimate);
    }
    for (const auto& [joint, value] : log.offsets_deg) add(offsets[joint], joint, "deg", value);
  }
  const auto gather = [](std::map<std::string, FleetTrend>& from, std::vector<FleetTrend>& to) {
    for (auto& [key, trend] : from) {
      if (trend.value.empty()) continue;
      trend.per_week = slope(trend.week, trend.value);
      to.push_back(std::move(trend));
    }
  };
  gather(causes, robot.causes);
  gather(offsets, robot.offsets);
  std::stable_sort(robot.causes.begin(), robot.causes.end(),
                   [](const auto& a, const auto& b) { return a.value.size() > b.value.size(); });
}

/// One log's offset of a joint.
struct Told {
  const FleetLog* log;
  double value_deg, sd_deg;
};

/// Logs that give this joint an offset and an interval.
std::vector<Told> told_of(const FleetRobot& robot, const std::string& joint) {
  constexpr double kHalfInterval_sd = 1.959964;
  std::vector<Told> told;
  for (const auto& log : robot.logs) {
    const auto value = log.offsets_deg.find(joint);
    const auto ci = log.offsets_ci95_deg.find(joint);
    if (value == log.offsets_deg.end() || ci == log.offsets_ci95_deg.end()) continue;
    const double sd = 0.5 * (ci->second[1] - ci->second[0]) / kHalfInterval_sd;
    if (std::isfinite(value->second) && sd > 0.0 && std::isfinite(sd)) told.push_back({&log, value->second, sd});
  }
  return told;
}

double median_without(const std::vector<Told>& told, std::size_t left_out) {
  std::vector<double> values;
  for (std::size_t i = 0; i < told.size(); ++i) {
    if (i != left_out) values.push_back(told[i].value_deg);
  }
  std::sort(values.begin(), values.end());
  const std::size_t middle = values.size() / 2;
  return values.size() % 2 == 1 ? values[middle] : 0.5 * (values[middle - 1] + values[middle]);
}

/// Pairs of logs are compared, not a log with the mean of all: one log that is wrong and sure of it would draw the mean
/// to itself and make every other look wrong.
void find_disagreements(FleetRobot& robot) {
  std::map<std::string, std::vector<Told>> joints;
  double pairs = 0.0;
  for (const auto& trend : robot.offsets) {
    auto told = told_of(robot, trend.name);
    if (told.size() < 2) continue;
    pairs += 0.5 * static_cast<double>(told.size() * (told.size() - 1));
    joints[trend.name] = std::move(told);
  }
  if (joints.empty()) return;
  const double most_z = normal_quantile(kFalseAlarm / pairs);  // over all pairs together
  for (const auto& [joint, told] : joints) {
    for (std::size_t i = 0; i < told.size(); ++i) {
      const auto differs = [&](const Told& other) {
        return std::abs(told[i].value_deg - other.value_deg) > most_z * std::hypot(told[i].sd_deg, other.sd_deg);
      };
      const auto with = static_cast<int>(std::count_if(told.begin(), told.end(), differs));
      if (with == 0) continue;
      robot.disagreements.push_back({told[i].log->name, joint, told[i].value_deg,
                                     told[i].log->offsets_ci95_deg.at(joint), median_without(told, i), with,
                                     static_cast<int>(told.size()) - 1});
    }
  }
  std::stable_sort(robot.disagreements.begin(), robot.disagreements.end(),
                   [](const auto& a, const auto& b) { return a.with * b.of > b.with * a.of; });
}

std::string date_text(Microseconds utime) {
  const auto time = static_cast<std::time_t>(utime / 1'000'000);
  std::tm utc{};
  char buffer[32];
  // Imported recordings without a date have stamps from zero on.
  constexpr Microseconds kYear2000 = 946'684'800'000'000;
  if (utime < kYear2000 || gmtime_r(&time, &utc) == nullptr) return "unknown";
  std::strftime(buffer, sizeof buffer, "%Y-%m-%d %H:%M", &utc);
  return buffer;
}

std::string causes_text(const FleetLog& log) {
  std::vector<std::string> parts;
  for (const auto& cause : log.causes) {
    auto text = cause.name;
    const auto told = rounded(cause.estimate, cause.ci95[0], cause.ci95[1]);
    if (std::isfinite(cause.estimate)) text += fmt::format(": {} {}", told.value, cause.unit);
    // What a diagnosis does not explain has none.
    if (std::isfinite(cause.ci95[0])) text += fmt::format(" ({} to {})", told.low, told.high);
    parts.push_back(std::move(text));
  }
  return fmt::format("{}", fmt::join(parts, "; "));
}

/// What the time axis of a robot's charts counts: months where its logs span some.
struct TimeAxis {
  const char* label;
  double per_week;  ///< 0: logs are counted
};

TimeAxis time_axis_of(const FleetRobot& robot) {
  const double weeks = seconds(robot.logs.back().begin - robot.logs.front().begin) / kWeek_s;
  // Recordings without dates of their own, as episodes of a data set are.
  if (weeks <= 0.0) return {"number of the log, by name", 0.0};
  if (weeks >= 9.0) return {"months since the first log", 12.0 / 52.1775};
  if (weeks >= 2.0) return {"weeks since the first log", 1.0};
  return {"days since the first log", 7.0};
}

Chart chart_of(const std::string& title, const std::string& y_label, const TimeAxis& axis,
               const std::vector<const FleetTrend*>& trends) {
  Chart chart{title, axis.label, y_label, Chart::Kind::kLine, {}, {}, false};
  for (const auto* trend : trends) {
    std::vector<double> x;
    for (std::size_t i = 0; i < trend->week.size(); ++i) {
      x.push_back(axis.per_week > 0.0 ? trend->week[i] * axis.per_week : static_cast<double>(trend->log[i] + 1));
    }
    chart.series.push_back({trend->name, std::move(x), trend->value});
  }
  return chart;
}

void add_disagreements(Report& report, const FleetRobot& robot) {
  if (robot.disagreements.empty()) return;
  report.paragraph(
      "Logs that disagree: offsets that differ by more than their intervals allow. One that disagrees with most others "
      "stands alone; where about half do, the robot changed in between, or its logs are less sure than they say.");
  std::vector<std::vector<std::string>> rows;
  for (const auto& d : robot.disagreements) {
    rows.push_back({d.log, d.joint,
                    fmt::format("{:.2f} ({:.2f} to {:.2f})", d.offset_deg, d.ci95_deg[0], d.ci95_deg[1]),
                    fmt::format("{:.2f}", d.others_deg), fmt::format("{} of {}", d.with, d.of)});
  }
  report.table({"log", "joint", "offset deg, 95 %", "median of the others", "disagrees with"}, rows);
}

void add_robot(Report& report, const FleetRobot& robot) {
  report.heading(robot.name);
  report.verdict(robot.sentence());
  std::vector<std::vector<std::string>> rows;
  for (const auto& log : robot.logs) {
    rows.push_back({date_text(log.begin), log.name, fmt::format("{:.0f}", log.duration_s), log.verdict,
                    log.causes.empty() ? log.sentence : causes_text(log)});
  }
  report.table({"begin (UTC)", "log", "s", "verdict", "causes, with 95 % intervals"}, rows);
  add_disagreements(report, robot);
  const TimeAxis axis = time_axis_of(robot);
  // One chart for each unit: causes in degrees and in milliseconds share no axis.
  std::map<std::string, std::vector<const FleetTrend*>> by_unit;
  for (const auto& trend : robot.causes) {
    if (trend.value.size() > 1) by_unit[trend.unit].push_back(&trend);
  }
  for (const auto& [unit, trends] : by_unit) {
    const std::string what = trends.size() == 1 ? trends.front()->name : "causes";
    report.chart(chart_of(robot.name + ": " + what + " over time", unit, axis, trends));
  }
  std::vector<const FleetTrend*> offsets;
  for (const auto& trend : robot.offsets) {
    if (trend.value.size() > 1) offsets.push_back(&trend);
  }
  if (!offsets.empty()) report.chart(chart_of(robot.name + ": joint offsets over time", "deg", axis, offsets));
}

Json json_of(const FleetTrend& t) {
  return {{"name", t.name}, {"unit", t.unit}, {"week", t.week}, {"value", t.value}, {"per_week", t.per_week}};
}

Json json_of(const FleetRobot& robot) {
  Json j = {{"robot", robot.name},     {"sentence", robot.sentence()}, {"logs", Json::array()},
            {"causes", Json::array()}, {"offsets", Json::array()},     {"disagreements", Json::array()}};
  for (const auto& log : robot.logs) {
    Json causes = Json::array();
    for (const auto& c : log.causes) {
      const auto finite = [](double x) { return std::isfinite(x) ? Json(x) : Json(nullptr); };
      causes.push_back({{"name", c.name},
                        {"parameter", c.parameter},
                        {"unit", c.unit},
                        {"estimate", finite(c.estimate)},
                        {"ci95", {finite(c.ci95[0]), finite(c.ci95[1])}}});
    }
    j["logs"].push_back({{"log", log.name},
                         {"begin_utime", log.begin},
                         {"duration_s", log.duration_s},
                         {"verdict", log.verdict},
                         {"sentence", log.sentence},
                         {"causes", causes}});
  }
  for (const auto& trend : robot.causes) j["causes"].push_back(json_of(trend));
  for (const auto& trend : robot.offsets) j["offsets"].push_back(json_of(trend));
  for (const auto& d : robot.disagreements) {
    j["disagreements"].push_back({{"log", d.log},
                                  {"joint", d.joint},
                                  {"offset_deg", d.offset_deg},
                                  {"ci95_deg", d.ci95_deg},
                                  {"median_of_others_deg", d.others_deg},
                                  {"with", d.with},
                                  {"of", d.of}});
  }
  return j;
}

std::vector<fs::path> folders_in(const fs::path& folder) {
  std::vector<fs::path> found;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (entry.is_directory(error)) found.push_back(entry.path());
  }
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace

std::string FleetRobot::sentence() const {
  const auto diagnosed = static_cast<std::size_t>(
      std::count_if(logs.begin(), logs.end(), [](const auto& log) { return log.verdict != kNotDiagnosed; }));
  std::string out = fmt::format("{} of {} logs diagnosed", diagnosed, logs.size());
  std::vector<std::string> parts;
  for (const auto& trend : causes) {
    std::string part =
        fmt::format("{} in {} log{}", trend.name, trend.value.size(), trend.value.size() == 1 ? "" : "s");
    if (trend.value.size() > 1 && trend.week.back() > trend.week.front()) {
      part += fmt::format(" ({:.3g} to {:.3g} {}, {:+.2g} a week)", trend.value.front(), trend.value.back(), trend.unit,
                          trend.per_week);
    } else {
      part += fmt::format(" ({:.3g} {})", trend.value.back(), trend.unit);
    }
    parts.push_back(part);
  }
  const auto is_unexplained = [](const FleetLog& log) { return log.verdict == "unexplained"; };
  const auto unexplained = static_cast<std::size_t>(std::count_if(logs.begin(), logs.end(), is_unexplained));
  if (!parts.empty()) {
    out += "; " + fmt::format("{}", fmt::join(parts, ", "));
  } else if (diagnosed > unexplained) {
    out += "; nothing wrong beside the offsets";
    if (unexplained > 0) out += fmt::format(" in {} of these", diagnosed - unexplained);
  }
  // Offsets of what is not explained stand in the page, but nothing is said to have moved by them.
  const auto of_explained = [&](const FleetTrend& t) {
    std::vector<double> values;
    for (std::size_t i = 0; i < t.value.size(); ++i) {
      if (!is_unexplained(logs[t.log[i]])) values.push_back(t.value[i]);
    }
    return values;
  };
  const auto moved = [&](const FleetTrend& t) {
    const auto values = of_explained(t);
    return values.empty() ? 0.0 : std::abs(values.back() - values.front());
  };
  const auto most = std::max_element(offsets.begin(), offsets.end(),
                                     [&](const auto& a, const auto& b) { return moved(a) < moved(b); });
  if (most != offsets.end() && moved(*most) > kMoved_deg) {
    const auto values = of_explained(*most);
    out +=
        fmt::format("; the offset of {} moved most, {:.2f} to {:.2f} deg", most->name, values.front(), values.back());
  }
  if (!disagreements.empty()) {
    const auto& first = disagreements.front();
    std::set<std::string> disagreeing;
    for (const auto& d : disagreements) disagreeing.insert(d.log);
    out += fmt::format("; {} logs disagree, most of all {} on {} ({:.2f} deg, others {:.2f})", disagreeing.size(),
                       first.log, first.joint, first.offset_deg, first.others_deg);
  }
  if (unexplained > 0) {
    out += fmt::format("; {} what no known cause explains",
                       unexplained == 1 ? std::string("1 log holds") : fmt::format("{} logs hold", unexplained));
  }
  return out;
}

std::vector<FleetRobot> gather_fleet(const fs::path& results) {
  std::vector<FleetRobot> robots;
  for (const auto& folder : folders_in(results)) {
    FleetRobot robot;
    robot.name = folder.filename().string();
    for (const auto& log : folders_in(folder)) robot.logs.push_back(read_log(log));
    if (robot.logs.empty()) continue;
    std::stable_sort(robot.logs.begin(), robot.logs.end(),
                     [](const auto& a, const auto& b) { return a.begin < b.begin; });
    find_trends(robot);
    find_disagreements(robot);
    robots.push_back(std::move(robot));
  }
  if (robots.empty()) {
    throw FileError(results.string() + ": no results, expected <robot>/<log>/info.json and outcome.txt");
  }
  return robots;
}

std::string write_fleet_report(const std::vector<FleetRobot>& robots, const fs::path& out) {
  Report report("Fleet");
  std::vector<std::vector<std::string>> rows;
  Json json = {{"robots", Json::array()}};
  std::string lines;
  for (const auto& robot : robots) {
    rows.push_back(
        {robot.name, date_text(robot.logs.front().begin), date_text(robot.logs.back().begin), robot.sentence()});
    json["robots"].push_back(json_of(robot));
    lines += robot.name + ": " + robot.sentence() + '\n';
  }
  report.table({"robot", "first log", "last log", "what is wrong with it"}, rows);
  for (const auto& robot : robots) add_robot(report, robot);
  report.write(out / "report.html");
  write_file(out / "fleet.json", json.dump(2, ' ', false, Json::error_handler_t::replace) + '\n');
  return lines;
}

}  // namespace bodyschema
