#include "verdict.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "limits.hpp"

namespace bodyschema::diagnosis {
namespace {

/// "6.2 mm (5.9 to 6.5)": of a size and its interval, without sign; an interval that reaches over zero says "up to".
std::string amount_text(const DiagnosedParameter& p) {
  const std::string unit = p.unit == "1" ? "" : p.unit == "%" ? " %" : " " + p.unit;
  double low = p.ci95[0], high = p.ci95[1];
  if (p.estimate < 0.0) std::tie(low, high) = std::pair(-high, -low);
  if (low < 0.0) return fmt::format("{:.3g}{} (at most {:.3g})", std::abs(p.estimate), unit, high);
  return fmt::format("{:.3g}{} ({:.3g} to {:.3g})", std::abs(p.estimate), unit, low, high);
}

std::string capitalised(std::string text) {
  // A name of the URDF keeps its letters.
  const auto word = text.substr(0, text.find(' '));
  if (word.find('_') == std::string::npos && !text.empty()) text[0] = static_cast<char>(std::toupper(text[0]));
  return text;
}

std::string sentence_of(const DiagnosedCause& cause, const DiagnosisReport& report, const JointRoles& roles) {
  if (cause.cause.name == "unexplained") {
    return fmt::format("something follows the {} of {} that no known cause explains", cause.variable,
                       cause.cause.joint);
  }
  const auto effect = make_effect(cause.cause.name, {cause.cause.joint, cause.cause.source}, roles);
  std::vector<std::string> amounts;
  std::size_t next = 0;
  std::string when;
  for (auto& p : effect->parameters()) {
    if (!p.fitted || next >= cause.parameters.size()) continue;
    const auto& e = cause.parameters[next++];
    p.value = e.estimate * p.si_per_unit;
    amounts.push_back(amount_text(e));
    if (when.empty()) when = e.when(report.begin_utime);
  }
  auto text = effect_kind(cause.cause.name).sentence(*effect, roles, amounts);
  if (!when.empty()) text += ", " + when;
  return text;
}

std::string with_class(const DiagnosedCause& cause) {
  std::string text = cause.sentence;
  if (cause.same.size() < 2) return text;
  text += " (or";
  for (std::size_t i = 1; i < cause.same.size(); ++i) text += (i > 1 ? ", " : " ") + cause.same[i].text();
  return text + ", which this log cannot tell from it)";
}

}  // namespace

void word_verdict(DiagnosisReport& report, const JointRoles& roles) {
  const auto is_unexplained = [](const DiagnosedCause& c) { return c.cause.name == "unexplained"; };
  const auto list_of = [&](std::vector<DiagnosedCause>& which) {
    std::string text;
    for (auto& cause : which) {
      cause.sentence = sentence_of(cause, report, roles);
      // Of a curve in several pieces one is enough.
      if (is_unexplained(cause) && text.find(cause.sentence) != std::string::npos) continue;
      text += (text.empty() ? "" : "; ") + with_class(cause);
    }
    return text;
  };
  list_of(report.estimated);
  const auto list = list_of(report.causes), small = list_of(report.small_causes);
  const auto& causes = report.causes;
  const auto unexplained = [&](std::string why) {
    report.verdict = "unexplained";
    report.sentence = std::move(why);
    if (!list.empty()) report.sentence += " What comes nearest, and may only stand in for it: " + list + ".";
    report.exclusion_limits.clear();
  };
  if (const double found = report.after.outline_found; found < limits::kLeastFound) {
    return unexplained(
        fmt::format("No cause can be told from this log: only {:.0f} % of the predicted outlines are found in "
                    "the pictures. The parts have another shape, or the masks miss some of them.",
                    100.0 * found));
  }
  if (std::any_of(causes.begin(), causes.end(), [](const auto& c) { return c.implausible; })) {
    return unexplained("No known cause explains this log: what fits is larger than on any robot.");
  }
  if (!report.not_in_model.empty()) {
    return unexplained("The pictures show something that the model lacks: " + report.not_in_model +
                       ". The hand holds a thing, or a part has no mesh.");
  }
  if (!report.side_left_over.empty()) {
    return unexplained(fmt::format("The model does not explain what is seen: {}.", report.side_left_over));
  }
  report.crowded = causes.empty() && report.small_causes.size() > 1;
  if (!causes.empty()) {
    const bool several = std::any_of(causes.begin(), causes.end(), [](const auto& c) { return c.same.size() > 1; });
    report.verdict = std::any_of(causes.begin(), causes.end(), is_unexplained) ? "unexplained"
                     : several                                                 ? "class"
                                                                               : "named";
    report.sentence = capitalised(list) + ".";
    if (report.verdict == "unexplained") report.exclusion_limits.clear();
    return;
  }
  report.verdict = "none";
  report.sentence = small.empty()
                        ? "The model explains the log to its noise: nothing but joint offsets was found."
                        : fmt::format(
                              "Nothing that matters was found but joint offsets. What is there moves hand and "
                              "outlines by less than {:.2g} mm: {}.",
                              report.matters_mm, small);
}

}  // namespace bodyschema::diagnosis
