#include "verdict.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace bodyschema::diagnosis {
namespace {

bool is_known(const EstimatedParameter& p) {
  return std::isfinite(p.ci95[0]) && std::isfinite(p.ci95[1]);
}

std::string text_of(const EstimatedParameter& p, Microseconds begin) {
  if (!is_known(p)) return fmt::format(" {} of a size that this log does not tell", p.parameter);
  const auto when = p.when(begin);
  return fmt::format(" {} {:.3g}{} [{:.3g}, {:.3g}]{}", p.parameter, p.estimate, p.unit == "1" ? "" : " " + p.unit,
                     p.ci95[0], p.ci95[1], when.empty() ? "" : " " + when);
}

std::string text_of(const DiagnosedCause& cause, Microseconds begin) {
  if (cause.cause.name == "unexplained") {
    return fmt::format("something that follows the {} of {} and that no known cause explains", cause.variable,
                       cause.cause.joint);
  }
  std::string text = cause.cause.text();
  for (const auto& p : cause.parameters) text += text_of(p, begin);
  if (cause.same.size() < 2) return text;
  text += " (or";
  for (std::size_t i = 1; i < cause.same.size(); ++i) {
    text += (i > 1 ? ", " : " ") + cause.same[i].text();
  }
  return text + ", which this log cannot tell from it)";
}

}  // namespace

void word_verdict(DiagnosisReport& report, const DiagnosisOptions& options) {
  const auto is_unexplained = [](const DiagnosedCause& c) { return c.cause.name == "unexplained"; };
  const auto& causes = report.causes;
  std::string list;
  for (const auto& cause : causes) list += (list.empty() ? "" : "; ") + text_of(cause, report.begin_utime);
  const double left = report.after.rms_px;

  if (left > options.trusted_rms_px) {
    report.verdict = "unexplained";
    report.sentence = fmt::format(
        "No cause of the catalogue explains this log: the outlines are missed by {:.1f} px (rms) at best, where "
        "good meshes and masks leave 0.3 px. The parts probably have another shape, or much is wrong at once.",
        left);
    if (!list.empty()) report.sentence += " What comes nearest, and may only stand in for it: " + list + ".";
    return;
  }
  if (const double found = report.after.outline_where_seen; found < options.trusted_outline) {
    report.verdict = "unexplained";
    report.sentence = fmt::format(
        "No cause can be told from this log: only {:.0f} % of the predicted outlines are found in the pictures. The "
        "parts have another shape, or the masks miss some of them.",
        100.0 * found);
    if (!list.empty()) report.sentence += " What comes nearest, and may only stand in for it: " + list + ".";
    return;
  }
  if (std::any_of(causes.begin(), causes.end(), [](const auto& c) { return c.implausible; })) {
    report.verdict = "unexplained";
    report.sentence =
        "No cause of the catalogue explains this log: what fits is larger than on any robot, and stands in "
        "for something else: " +
        list + ".";
    return;
  }
  if (!causes.empty()) {
    const bool unexplained = std::any_of(causes.begin(), causes.end(), is_unexplained);
    const bool several = std::any_of(causes.begin(), causes.end(), [](const auto& c) { return c.same.size() > 1; });
    const bool sized = std::all_of(causes.begin(), causes.end(), [](const auto& c) {
      return std::all_of(c.parameters.begin(), c.parameters.end(), is_known);
    });
    report.verdict = unexplained || !sized ? "unexplained" : several ? "class" : "named";
    report.sentence = "The log asks for: " + list + ".";
    if (left > options.noise_rms_px) {
      report.sentence +=
          fmt::format(" With it {:.2f} px are left, more than noise: something else is wrong too.", left);
    }
    return;
  }
  report.verdict = "none";
  if (report.crowded) {
    report.sentence = "No single cause stands out; several small errors share what the joint offsets leave.";
  } else if (left > options.noise_rms_px) {
    report.verdict = "unexplained";
    report.sentence = fmt::format(
        "No cause of the catalogue explains what is left: {:.2f} px (rms), more than noise, whatever the joint "
        "offsets.",
        left);
  } else if (const auto& part = report.out_of_sight) {
    report.verdict = "unexplained";
    report.sentence = fmt::format(
        "The model explains a part of the log only: from {:.1f} to {:.1f} s the outlines are out of sight. Something "
        "moved further than can be followed, or what is seen there is not the hand.",
        part->from_s, part->to_s);
  } else {
    report.sentence = "The model explains the log to its noise: nothing but joint offsets was found.";
  }
}

}  // namespace bodyschema::diagnosis
