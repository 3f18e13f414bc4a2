#include "bodyschema/diagnosis/diagnosis_report.hpp"

#include <spdlog/fmt/fmt.h>

#include <cmath>
#include <ctime>
#include <nlohmann/json.hpp>

#include "bodyschema/core/error.hpp"
#include "bodyschema/core/write_file.hpp"

namespace bodyschema {
namespace {

using Json = nlohmann::ordered_json;

/// JSON has no infinities: what is not finite is null.
Json number(double x) {
  return std::isfinite(x) ? Json(x) : Json(nullptr);
}

Json optional_text(const std::string& text) {
  return text.empty() ? Json(nullptr) : Json(text);
}

Json json_of(const HeldoutError& e) {
  return {{"rms_px", number(e.rms_px)},
          {"hand_mm", number(e.hand_mm)},
          {"hand_deg", number(e.hand_deg)},
          {"outline_found", number(e.outline_found)},
          {"outline_where_seen", number(e.outline_where_seen)},
          {"moved_px", number(e.moved_px)},
          {"encoders_px", number(e.encoders_px)}};
}

Json json_of(const CauseName& c) {
  Json j = {{"name", c.name}, {"joint", optional_text(c.joint)}};
  if (!c.source.empty()) j["source"] = c.source;
  return j;
}

Json json_of(const DiagnosedParameter& p) {
  Json j = {{"parameter", p.parameter},
            {"unit", p.unit},
            {"estimate", number(p.estimate)},
            {"ci95", {number(p.ci95[0]), number(p.ci95[1])}}};
  if (p.from) j["from_utime"] = *p.from;
  if (p.duration_s) j["duration_s"] = number(*p.duration_s);
  return j;
}

/// "12:03:07 UTC".
std::string clock_time(Microseconds utime) {
  const auto t = static_cast<std::time_t>(seconds(utime));
  std::tm parts{};
  gmtime_r(&t, &parts);
  return fmt::format("{:02}:{:02}:{:02} UTC", parts.tm_hour, parts.tm_min, parts.tm_sec);
}

Json json_of(const DiagnosedCause& c) {
  Json j = json_of(c.cause);
  if (!c.variable.empty()) j["variable"] = c.variable;
  // The parameter that is furthest from zero stands for the cause; all are listed as well.
  const DiagnosedParameter* first = nullptr;
  double best = -1.0;
  for (const auto& p : c.parameters) {
    const double half = 0.5 * (p.ci95[1] - p.ci95[0]);
    const double ratio = half > 0.0 ? std::abs(p.estimate) / half : 0.0;
    if (ratio > best) {
      best = ratio;
      first = &p;
    }
  }
  j["parameter"] = first ? Json(first->parameter) : Json(nullptr);
  j["unit"] = first ? Json(first->unit) : Json(nullptr);
  j["estimate"] = first ? number(first->estimate) : Json(nullptr);
  j["ci95"] = first ? Json{number(first->ci95[0]), number(first->ci95[1])} : Json(nullptr);
  j["sentence"] = c.sentence;
  j["class"] = Json::array();
  for (const auto& s : c.same) j["class"].push_back(json_of(s));
  j["z"] = number(c.z);
  j["implausible"] = c.implausible;
  j["heldout_gain"] = number(c.heldout_gain);
  j["parameters"] = Json::array();
  for (const auto& p : c.parameters) j["parameters"].push_back(json_of(p));
  if (!c.advice.empty()) j["motion_that_would_tell"] = c.advice;
  return j;
}

}  // namespace

std::string CauseName::text() const {
  std::string text = name;
  if (!joint.empty()) text += " of " + joint;
  if (!source.empty()) text += (joint.empty() ? " " : " with ") + source;
  return text;
}

std::string DiagnosedParameter::when(Microseconds log_begin) const {
  if (!from) return "";
  if (log_begin == 0) return "at " + clock_time(*from);
  const double begin_s = seconds(*from - log_begin);
  if (!duration_s) return fmt::format("{:.1f} s into the log", begin_s);
  return fmt::format("from {:.1f} to {:.1f} s into the log", begin_s, begin_s + *duration_s);
}

std::string DiagnosisReport::to_json() const {
  Json j;
  j["verdict"] = verdict;
  j["sentence"] = sentence;
  j["crowded"] = crowded;
  j["causes"] = Json::array();
  for (const auto& c : causes) j["causes"].push_back(json_of(c));
  j["small_causes"] = Json::array();
  for (const auto& c : small_causes) j["small_causes"].push_back(json_of(c));
  j["estimated"] = Json::array();
  for (const auto& c : estimated) j["estimated"].push_back(json_of(c));
  j["not_testable"] = Json::array();
  for (const auto& n : not_testable) {
    auto entry = json_of(n.cause);
    entry["reason"] = n.reason;
    j["not_testable"].push_back(entry);
  }
  j["exclusion_limits"] = Json::array();
  for (const auto& l : exclusion_limits) {
    auto entry = json_of(l.cause);
    entry["parameter"] = l.parameter;
    entry["unit"] = l.unit;
    entry["limit"] = number(l.limit);
    j["exclusion_limits"].push_back(entry);
  }
  j["heldout"] = {{"before", json_of(before)}, {"after", json_of(after)}};
  j["offsets_deg"] = {{"before", Json::object()}, {"after", Json::object()}};
  for (const auto& [joint, value] : offsets_deg_before) j["offsets_deg"]["before"][joint] = number(value);
  for (const auto& [joint, value] : offsets_deg_after) j["offsets_deg"]["after"][joint] = number(value);
  j["offsets_ci95_deg"] = Json::object();
  for (const auto& [joint, ci] : offsets_ci95_deg) {
    j["offsets_ci95_deg"][joint] = {number(ci[0]), number(ci[1])};
  }
  j["log"] = {{"begin_utime", begin_utime},
              {"duration_s", number(duration_s)},
              {"views", views},
              {"blocks", blocks},
              {"block_s", number(block_s)}};
  j["warnings"] = warnings;
  j["next_steps"] = next_steps;
  j["left_px"] = number(left_px);
  j["noise_px"] = number(noise_px);
  j["side_left_over"] = optional_text(side_left_over);
  j["not_in_model"] = optional_text(not_in_model);
  return j.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";  // names of files may be no UTF-8
}

void DiagnosisReport::prepare(const std::filesystem::path& directory) {
  make_folder(directory);
  std::error_code error;
  const auto probe = directory / "report.json.part";
  write_file(probe, "");
  std::filesystem::remove(probe, error);
}

void DiagnosisReport::write(const std::filesystem::path& directory) const {
  prepare(directory);
  write_file(directory / "report.json", to_json());
  if (extended_model) extended_model->save(directory / "extended_model.yaml");
}

}  // namespace bodyschema
