#include "bodyschema/fleet/fleet_report.hpp"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <fstream>
#include <limits>
#include <spdlog/fmt/fmt.h>
#include <sstream>

#include <nlohmann/json.hpp>

#include "bodyschema/core/error.hpp"
#include "bodyschema/core/write_file.hpp"
#include "bodyschema/report/report.hpp"

namespace bodyschema {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr double kWeek_s = 7.0 * 24.0 * 3600.0;
constexpr const char* kNotDiagnosed = "not diagnosed";
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
  const auto add = [](FleetTrend& trend, const std::string& name, const std::string& unit, double week, double value) {
    if (!std::isfinite(value)) return;
    trend.name = name;
    trend.unit = unit;
    trend.week.push_back(week);
    trend.value.push_back(value);
  };
  const Microseconds first = robot.logs.front().begin;
  for (const auto& log : robot.logs) {
    const double week = seconds(log.begin - first) / kWeek_s;
    for (const auto& cause : log.causes) {
      const std::string name = cause.parameter.empty() || cause.name.starts_with(cause.parameter)
                                   ? cause.name
                                   : cause.name + " (" + cause.parameter + ")";
      add(causes[name + cause.unit], name, cause.unit, week, cause.estimate);
    }
    for (const auto& [joint, value] : log.offsets_deg) add(offsets[joint], joint, "deg", week, value);
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

std::string date_text(Microseconds utime) {
  const auto time = static_cast<std::time_t>(utime / 1'000'000);
  std::tm utc{};
  char buffer[32];
  if (utime <= 0 || gmtime_r(&time, &utc) == nullptr) return "unknown";
  std::strftime(buffer, sizeof buffer, "%Y-%m-%d %H:%M", &utc);
  return buffer;
}

std::string causes_text(const FleetLog& log) {
  std::vector<std::string> parts;
  for (const auto& cause : log.causes) {
    auto text = cause.name;
    if (std::isfinite(cause.estimate)) text += fmt::format(": {:.3g} {}", cause.estimate, cause.unit);
    // What a diagnosis does not explain has none.
    if (std::isfinite(cause.ci95[0])) text += fmt::format(" ({:.3g} to {:.3g})", cause.ci95[0], cause.ci95[1]);
    parts.push_back(std::move(text));
  }
  return fmt::format("{}", fmt::join(parts, "; "));
}

Chart chart_of(const std::string& title, const std::string& y_label, const std::vector<const FleetTrend*>& trends) {
  Chart chart{title, "weeks since the first log", y_label, Chart::Kind::kLine, {}, {}, false};
  for (const auto* trend : trends) chart.series.push_back({trend->name, trend->week, trend->value});
  return chart;
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
  // One chart for each unit: causes in degrees and in milliseconds share no axis.
  std::map<std::string, std::vector<const FleetTrend*>> by_unit;
  for (const auto& trend : robot.causes) {
    if (trend.value.size() > 1) by_unit[trend.unit].push_back(&trend);
  }
  for (const auto& [unit, trends] : by_unit) {
    const std::string what = trends.size() == 1 ? trends.front()->name : "causes";
    report.chart(chart_of(robot.name + ": " + what + " over time", unit, trends));
  }
  std::vector<const FleetTrend*> offsets;
  for (const auto& trend : robot.offsets) {
    if (trend.value.size() > 1) offsets.push_back(&trend);
  }
  if (!offsets.empty()) report.chart(chart_of(robot.name + ": joint offsets over time", "deg", offsets));
}

Json json_of(const FleetTrend& t) {
  return {{"name", t.name}, {"unit", t.unit}, {"week", t.week}, {"value", t.value}, {"per_week", t.per_week}};
}

Json json_of(const FleetRobot& robot) {
  Json j = {{"robot", robot.name},
            {"sentence", robot.sentence()},
            {"logs", Json::array()},
            {"causes", Json::array()},
            {"offsets", Json::array()}};
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
  if (diagnosed > 0)
    out += parts.empty() ? "; nothing wrong beside the offsets" : "; " + fmt::format("{}", fmt::join(parts, ", "));
  const auto moved = [](const FleetTrend& t) { return std::abs(t.value.back() - t.value.front()); };
  const auto most = std::max_element(offsets.begin(), offsets.end(),
                                     [&](const auto& a, const auto& b) { return moved(a) < moved(b); });
  if (most != offsets.end() && moved(*most) > kMoved_deg) {
    out += fmt::format("; the offset of {} moved most, {:.2f} to {:.2f} deg", most->name, most->value.front(),
                       most->value.back());
  }
  const bool unexplained =
      std::any_of(logs.begin(), logs.end(), [](const auto& log) { return log.verdict == "unexplained"; });
  if (unexplained) out += "; some logs hold structure that no known cause explains";
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
