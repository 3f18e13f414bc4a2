#include "verdict.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "bodyschema/core/rounded.hpp"
#include "limits.hpp"

namespace bodyschema::diagnosis {
namespace {

constexpr const char* kLarge =
    " So much is more than robots are usually off by, and explains all that is seen: is this the robot's model, and "
    "are its units right?";

/// "6.2 mm (5.9 to 6.5)": of a size and its interval, where there is one, without sign; an interval that reaches over
/// zero says "at most".
std::string amount_text(const DiagnosedParameter& p) {
  const std::string unit = p.unit == "1" ? "" : p.unit == "%" ? " %" : " " + p.unit;
  double low = p.ci95[0], high = p.ci95[1];
  if (!std::isfinite(low)) return "roughly " + roughly(std::abs(p.estimate)) + unit;
  if (p.estimate < 0.0) std::tie(low, high) = std::pair(-high, -low);
  const auto told = rounded(std::abs(p.estimate), low, high);
  if (low < 0.0) return fmt::format("{}{} (at most {})", told.value, unit, told.high);
  return fmt::format("{}{} ({} to {})", told.value, unit, told.low, told.high);
}

std::string capitalised(std::string text) {
  // A name of the URDF keeps its letters.
  const auto word = text.substr(0, text.find(' '));
  if (word.find('_') == std::string::npos && !text.empty()) text[0] = static_cast<char>(std::toupper(text[0]));
  return text;
}

/// "joint coupling of elbow with prosup".
std::string in_words(CauseName cause) {
  std::replace(cause.name.begin(), cause.name.end(), '_', ' ');
  return cause.text();
}

std::string with_class(const DiagnosedCause& cause) {
  std::string text = cause.sentence;
  if (cause.same.size() < 2) return text;
  text += " (or";
  for (std::size_t i = 1; i < cause.same.size(); ++i) text += (i > 1 ? ", " : " ") + in_words(cause.same[i]);
  return text + ", which this log cannot tell from it)";
}

/// " along +y of the link r_upper_arm": of a size across the axis of a joint; of any other nothing.
std::string direction_of(const DiagnosedParameter& p, const CauseName& cause, const std::vector<AcrossAxis>& across) {
  const auto joint = std::find_if(across.begin(), across.end(), [&](const auto& a) { return a.joint == cause.joint; });
  if (joint == across.end()) return "";
  for (const std::size_t which : {0u, 1u}) {
    const auto number = std::to_string(which + 1);
    const char* word = p.parameter == "shift_" + number ? " along " : p.parameter == "tilt_" + number ? " about " : "";
    if (*word != '\0') return word + joint->direction(which, p.estimate >= 0.0);
  }
  return "";
}

/// What stands out and would move the hand by what matters, but outlines by less than any picture places them: meshes
/// that are larger by as much as the focal length is longer. Nothing says whether it is there, nor that it is not.
std::string hardly_seen(const DiagnosisReport& report) {
  double hand_mm = 0.0, outline_px = 0.0;
  for (const auto& cause : report.small_causes) {
    if (cause.hand_mm < report.matters_mm) continue;
    hand_mm = std::max(hand_mm, cause.hand_mm);
    outline_px = std::max(outline_px, cause.outline_px);
  }
  if (hand_mm <= 0.0) return "";
  return fmt::format(
      "This log does not tell whether the model is right: what it asks for moves outlines by {:.2g} px, which is "
      "less than any picture places them, but the hand by {:.2g} mm.",
      outline_px, hand_mm);
}

/// The same beside causes that are named: they stand, and this is neither named nor excluded.
std::string besides(const DiagnosisReport& report) {
  std::string text;
  for (const auto& cause : report.small_causes) {
    if (cause.hand_mm < report.matters_mm) continue;
    text += fmt::format(
        " Not told is whether {}: that moves the hand by {:.2g} mm, but outlines by {:.2g} px, which is less than any "
        "picture places them.",
        cause.sentence, cause.hand_mm, cause.outline_px);
  }
  return text;
}

/// What stands out though no cause describes it, however little a curve over it moves: the curve is a stand-in, and
/// its size none of what is really there.
std::string of_no_known_size(const DiagnosisReport& report) {
  for (const auto& cause : report.small_causes) {
    if (cause.cause.name != "unexplained") continue;
    return fmt::format(
        "Something follows the {} of {} that no known cause describes: it stands out of the log's noise, but how "
        "much of what is seen it is, nothing tells.",
        cause.variable, cause.cause.joint);
  }
  return "";
}

bool larger_than_on_any_robot(const DiagnosisReport& report) {
  return std::any_of(report.causes.begin(), report.causes.end(), [](const auto& c) { return c.implausible; });
}

/// Whether what is left differs from one part of the log to another, and never as if the arm stood elsewhere: a cause
/// that stands in for another one leaves some of it.
bool leaves_noise_alone(const DiagnosisReport& report) {
  return report.noise_px > 0.0 && report.left_px <= limits::kNoiseRatio * report.noise_px &&
         report.after.moved_px <= report.after.encoders_px;
}

/// Why no answer of this report is to be trusted; empty: it is.
std::string why_not(const DiagnosisReport& report) {
  const auto& causes = report.causes;
  if (const double found = report.after.outline_found; found < limits::kLeastFound) {
    return fmt::format(
        "No cause can be told from this log: only {:.0f} % of the predicted outlines are found in "
        "the pictures. The parts have another shape, or the masks miss some of them.",
        100.0 * found);
  }
  if (larger_than_on_any_robot(report) && !leaves_noise_alone(report)) {
    return "No known cause explains this log: what fits is larger than on any robot.";
  }
  if (!report.not_in_model.empty()) {
    return "The pictures show something that the model lacks: " + report.not_in_model +
           ". The hand holds a thing, or a part has no mesh.";
  }
  if (!report.side_left_over.empty()) {
    return fmt::format("The model does not explain what is seen: {}.", report.side_left_over);
  }
  if (report.more_asked) {
    return fmt::format("More is wrong than {} causes explain: the log asks for another one.", limits::kMostCauses);
  }
  if (report.rough_px > 0.0 && report.left_px > report.rough_px) {
    return fmt::format(
        "The model does not explain what is seen: outlines lie off by {:.2f} px, and where the model is right "
        "none are rougher than {:.1f} px.",
        report.left_px, report.rough_px);
  }
  const auto& after = report.after;
  const double still_px = std::sqrt(std::max(0.0, after.rms_px * after.rms_px - after.moved_px * after.moved_px));
  if (after.moved_px > after.encoders_px && after.rms_px > limits::kNoiseRatio * still_px) {
    return fmt::format(
        "The model does not explain what is seen: outlines lie off by {:.2f} px, and only {:.2f} px of that is "
        "noise of single pictures. In the rest pictures agree that the arm stood elsewhere from instant to instant, by "
        "more than encoders err: something moves it that no known cause describes.",
        after.rms_px, still_px);
  }
  if (causes.empty() && report.noise_px > 0.0 && report.left_px > limits::kNoiseRatio * report.noise_px) {
    return fmt::format(
        "The model does not explain what is seen, and no known cause does: outlines lie off by {:.2f} "
        "px, and but {:.2f} px of that differ from one part of the log to another.",
        report.left_px, report.noise_px);
  }
  if (!causes.empty()) return "";
  const std::string unknown = of_no_known_size(report);
  return unknown.empty() ? hardly_seen(report) : unknown;
}

/// " among the 61 causes that it can test (65 that it cannot)".
std::string of_how_many(const DiagnosisReport& report) {
  std::vector<CauseName> tested;
  for (const auto& limit : report.exclusion_limits) {
    if (std::find(tested.begin(), tested.end(), limit.cause) == tested.end()) tested.push_back(limit.cause);
  }
  if (report.not_testable.empty()) return "";
  return fmt::format(" among the {} causes that it can test ({} that it cannot)", tested.size(),
                     report.not_testable.size());
}

/// Of a model that does not fit there are neither intervals nor limits.
void forget_intervals(DiagnosisReport& report) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  for (auto* list : {&report.causes, &report.small_causes, &report.estimated, &report.estimates}) {
    for (auto& cause : *list) {
      for (auto& p : cause.parameters) p.ci95 = {kNone, kNone};
    }
  }
  for (auto& [joint, ci] : report.offsets_ci95_deg) ci = {kNone, kNone};
  report.exclusion_limits.clear();
}

}  // namespace

std::string sentence_of(const DiagnosedCause& cause, const DiagnosisReport& report, const JointRoles& roles,
                        const std::vector<AcrossAxis>& across) {
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
    amounts.push_back(amount_text(e) + direction_of(e, cause.cause, across));
    if (when.empty()) when = e.when(report.begin_utime);
  }
  auto text = effect_kind(cause.cause.name).sentence(*effect, roles, amounts);
  if (!when.empty()) text += ", " + when;
  return text;
}

void word_verdict(DiagnosisReport& report, const JointRoles& roles, const std::vector<AcrossAxis>& across) {
  const auto is_unexplained = [](const DiagnosedCause& c) { return c.cause.name == "unexplained"; };
  const auto list_of = [&](std::vector<DiagnosedCause>& which, bool classes) {
    std::string text;
    for (auto& cause : which) {
      cause.sentence = sentence_of(cause, report, roles, across);
      // Of a curve in several pieces one is enough.
      if (is_unexplained(cause) && text.find(cause.sentence) != std::string::npos) continue;
      text += (text.empty() ? "" : "; ") + (classes ? with_class(cause) : cause.sentence);
    }
    return text;
  };
  const auto& causes = report.causes;
  const auto why = why_not(report);
  const bool unexplained = !why.empty() || std::any_of(causes.begin(), causes.end(), is_unexplained);
  if (unexplained) forget_intervals(report);
  // Of what matters to nobody, or only stands in for something, nobody asks which of several it is.
  const auto list = list_of(report.causes, why.empty()), small = list_of(report.small_causes, false),
             estimated = list_of(report.estimated, false);
  if (!why.empty()) {
    report.verdict = "unexplained";
    report.sentence = why;
    const auto& nearest = list.empty() ? small : list;
    if (!nearest.empty()) report.sentence += " What comes nearest, and may only stand in for it: " + nearest + ".";
    return;
  }
  const auto taken_up =
      estimated.empty() ? "" : " Of what is estimated in any case the pictures ask for: " + estimated + ".";
  report.crowded = causes.empty() && report.small_causes.size() > 1;
  if (!causes.empty()) {
    const bool several = std::any_of(causes.begin(), causes.end(), [](const auto& c) { return c.same.size() > 1; });
    report.verdict = unexplained ? "unexplained" : several ? "class" : "named";
    const bool large = !unexplained && larger_than_on_any_robot(report);
    report.sentence = capitalised(list) + "." + (large ? kLarge : "") + besides(report) + taken_up;
    return;
  }
  report.verdict = "none";
  const std::string known = estimated.empty() ? "joint offsets" : "what is estimated in any case";
  report.sentence =
      small.empty()
          ? "The model explains the log to its noise: nothing but " + known + " was found" + of_how_many(report) + "."
          : fmt::format(
                "Nothing that matters was found but {}. What is there moves hand and "
                "outlines by less than {:.2g} mm, or outlines by less than any picture places them: {}.",
                known, report.matters_mm, small);
  report.sentence += taken_up;
}

}  // namespace bodyschema::diagnosis
