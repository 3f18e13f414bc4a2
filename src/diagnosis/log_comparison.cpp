#include "bodyschema/diagnosis/log_comparison.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "bodyschema/core/order_statistics.hpp"
#include "bodyschema/core/rounded.hpp"
#include "bodyschema/core/write_file.hpp"
#include "bodyschema/evidence/distributions.hpp"
#include "bodyschema/report/report.hpp"
#include "limits.hpp"
#include "verdict.hpp"

namespace bodyschema {
namespace {

using diagnosis::limits::kConfidence;

/// Half of a 95 % interval.
double half(const std::array<double, 2>& ci) {
  return 0.5 * (ci[1] - ci[0]);
}

/// What happened once, at a time of its own log, is no claim about another; nor is a curve without a name.
bool is_claim(const DiagnosedCause& cause) {
  return cause.cause.name != "unexplained" && effect_kind(cause.cause.name).timing == EffectTiming::kAlways;
}

const DiagnosedCause* find(const std::vector<DiagnosedCause>& causes, const CauseName& name) {
  const auto at = std::find_if(causes.begin(), causes.end(), [&](const auto& c) { return c.cause == name; });
  return at == causes.end() ? nullptr : &*at;
}

/// The cause in a log's answer, large or small; else what the log says of it beside its answer.
const DiagnosedCause* said_of(const DiagnosisReport& report, const CauseName& name) {
  for (const auto* causes : {&report.causes, &report.small_causes, &report.estimates}) {
    if (const auto* cause = find(*causes, name)) return cause;
  }
  return nullptr;
}

std::string text_of(const DiagnosedCause& cause) {
  std::string text;
  for (const auto& p : cause.parameters) {
    const auto told = rounded(p.estimate, p.ci95[0], p.ci95[1]);
    text += fmt::format("{}{} {} {} ({} to {})", text.empty() ? "" : ", ", p.parameter, told.value, p.unit, told.low,
                        told.high);
  }
  return text;
}

/// A joint that a cause acts on: its offset trades a constant with it.
bool is_about(const DiagnosedCause& cause, const std::string& joint) {
  return cause.cause.joint == joint || (cause.cause.source == joint && !cause.cause.joint.empty());
}

class Comparison {
 public:
  Comparison(const std::vector<DiagnosisReport>& reports, const JointRoles& roles,
             const std::vector<AcrossAxis>& across, LogComparison& out)
      : reports_(reports), roles_(roles), across_(across), out_(out) {}

  void run() {
    for (std::size_t a = 0; a < reports_.size(); ++a) {
      if (reports_[a].verdict == "unexplained") continue;
      for (const auto& cause : reports_[a].causes) {
        if (!is_claim(cause)) continue;
        std::vector<std::size_t> agree = {a};
        for (std::size_t b = 0; b < reports_.size(); ++b) {
          if (b == a) continue;
          auto claim = judge(a, cause, b);
          if (claim.judgement == Judgement::kAgrees) agree.push_back(b);
          out_.claims.push_back(std::move(claim));
        }
        const bool told = std::any_of(out_.common.begin(), out_.common.end(),
                                      [&](const auto& c) { return c.cause.cause == cause.cause; });
        if (agree.size() > 1 && !told) out_.common.push_back(together(cause, agree));
      }
    }
    for (std::size_t b = 1; b < reports_.size(); ++b) compare_offsets(b - 1, b);
    say();
  }

 private:
  JudgedClaim judge(std::size_t a, const DiagnosedCause& claim, std::size_t b) const {
    JudgedClaim result{.claimed_by = a, .judged_by = b, .cause = claim.cause, .claim = claim.sentence, .why = {}};
    const auto& other = reports_[b];
    if (other.verdict == "unexplained") {
      result.why = "that log is not explained";
      return result;
    }
    for (const auto& untestable : other.not_testable) {
      if (untestable.cause != claim.cause) continue;
      result.why = untestable.reason;
      return result;
    }
    const auto* own = said_of(other, claim.cause);
    if (!own || own->parameters.size() != claim.parameters.size()) {
      result.why = "offsets and usual nuisances make up for it there";
      return result;
    }
    result.why = text_of(*own) + " there";
    // As many comparisons as parameters: Bonferroni. Half a width stands for a standard deviation.
    const double tail = kConfidence / static_cast<double>(std::max<std::size_t>(1, claim.parameters.size()));
    const double wider = between(a, b) * normal_quantile(tail) / normal_quantile(kConfidence);
    bool there = false, same = true;
    for (std::size_t i = 0; i < claim.parameters.size(); ++i) {
      const auto& p = claim.parameters[i];
      const auto& q = own->parameters[i];
      there = there || std::abs(q.estimate) > wider * half(q.ci95);
      same = same && std::abs(q.estimate - p.estimate) <= wider * std::hypot(half(p.ci95), half(q.ci95));
    }
    const bool listed = find(other.causes, claim.cause) || find(other.small_causes, claim.cause);
    result.judgement = same && (there || listed) ? Judgement::kAgrees
                       : same                    ? Judgement::kNothing
                       : there || listed         ? Judgement::kDiffers
                                                 : Judgement::kContradicts;
    return result;
  }

  /// Each log's size by how well it is known.
  CommonCause together(const DiagnosedCause& first, const std::vector<std::size_t>& logs) const {
    CommonCause common{.cause = first, .logs = logs};
    for (std::size_t i = 0; i < first.parameters.size(); ++i) {
      double weight = 0.0, sum = 0.0;
      for (const auto log : logs) {
        const auto& p = said_of(reports_[log], first.cause)->parameters[i];
        const double w = 1.0 / std::max(1e-300, half(p.ci95) * half(p.ci95));
        weight += w;
        sum += w * p.estimate;
      }
      auto& p = common.cause.parameters[i];
      p.estimate = sum / weight;
      const double width = 1.0 / std::sqrt(weight);
      p.ci95 = {p.estimate - width, p.estimate + width};
    }
    // What fits one log as well and another worse does not fit the robot.
    for (const auto log : logs) {
      const auto* own = find(reports_[log].causes, first.cause);
      if (!own) continue;
      std::erase_if(common.cause.same, [&](const CauseName& name) {
        return std::find(own->same.begin(), own->same.end(), name) == own->same.end();
      });
    }
    common.cause.sentence = diagnosis::sentence_of(common.cause, reports_[logs.front()], roles_, across_);
    return common;
  }

  /// An offset at the end of one log and at the beginning of a later one.
  struct Pair {
    std::string joint;
    double change_deg, half_deg;  ///< half of the 95 % interval that the logs' own give
  };
  [[nodiscard]] std::vector<Pair> offsets(std::size_t a, std::size_t b) const {
    const auto& before = reports_[a];
    const auto& after = reports_[b];
    std::vector<Pair> pairs;
    for (const auto& [joint, offset] : before.offsets_deg_after) {
      const auto later = after.offsets_deg_after.find(joint);
      const auto ci_a = before.offsets_ci95_deg.find(joint), ci_b = after.offsets_ci95_deg.find(joint);
      if (later == after.offsets_deg_after.end() || ci_a == before.offsets_ci95_deg.end() ||
          ci_b == after.offsets_ci95_deg.end()) {
        continue;
      }
      double end = offset;
      for (const auto& cause : before.causes) {
        // From a slip on the joint stands further than its encoder says.
        if (cause.cause.joint == joint && cause.cause.name == "slip") end -= cause.parameters.front().estimate;
      }
      const double half_deg = std::hypot(half(ci_a->second), half(ci_b->second));
      if (half_deg > 0.0) pairs.push_back({joint, later->second - end, half_deg});
    }
    return pairs;
  }

  /// By how much logs differ from each other more than each by itself lets expect: other postures show other errors of
  /// the model. Measured on the offsets of all joints, of which few have slipped: the median size of their changes over
  /// that of a normal variable.
  [[nodiscard]] double between(std::size_t a, std::size_t b) const {
    std::vector<double> sizes;
    for (const auto& pair : offsets(a, b)) {
      sizes.push_back(std::abs(pair.change_deg) / pair.half_deg * normal_quantile(kConfidence));
    }
    constexpr std::size_t kFewest = 4;
    if (sizes.size() < kFewest) return 1.0;
    constexpr double kHalf = 0.5;
    return std::max(1.0, median(sizes) / normal_quantile(kHalf));
  }

  /// At the end of one log against the beginning of the next.
  void compare_offsets(std::size_t a, std::size_t b) {
    if (reports_[a].verdict == "unexplained" || reports_[b].verdict == "unexplained") return;
    // One in a hundred, over all joints.
    constexpr double kLevel = 0.01;
    const auto pairs = offsets(a, b);
    const double tail = kLevel / static_cast<double>(std::max<std::size_t>(1, pairs.size()));
    const double wider = normal_quantile(tail) / normal_quantile(kConfidence), spread = between(a, b);
    for (const auto& pair : pairs) {
      if (trades(a, b, pair.joint) || trades(b, a, pair.joint)) {
        if (std::find(out_.not_compared.begin(), out_.not_compared.end(), pair.joint) == out_.not_compared.end())
          out_.not_compared.push_back(pair.joint);
        continue;
      }
      const double ci = spread * pair.half_deg;
      if (std::abs(pair.change_deg) <= wider * ci) continue;
      out_.changes.push_back({a, b, pair.joint, pair.change_deg, {pair.change_deg - ci, pair.change_deg + ci}});
    }
  }

  /// Whether the log has a cause of this joint that trades a constant with its offset, and the other does not share it.
  [[nodiscard]] bool trades(std::size_t log, std::size_t other, const std::string& joint) const {
    return std::any_of(reports_[log].causes.begin(), reports_[log].causes.end(), [&](const DiagnosedCause& cause) {
      if (!is_about(cause, joint) || cause.cause.name == "slip") return false;
      return std::none_of(out_.common.begin(), out_.common.end(), [&](const CommonCause& common) {
        return common.cause.cause == cause.cause &&
               std::find(common.logs.begin(), common.logs.end(), other) != common.logs.end();
      });
    });
  }

  void say() {
    std::vector<std::string> parts;
    for (const auto& common : out_.common) {
      parts.push_back((common.logs.size() == reports_.size()
                           ? "In all logs: "
                           : fmt::format("In {} of {} logs: ", common.logs.size(), reports_.size())) +
                      common.cause.sentence);
    }
    for (const auto& change : out_.changes) {
      parts.push_back(fmt::format("Between {} and {} {} slipped: its encoder reads {:.2f} deg ({:.2f} to {:.2f}) {}",
                                  out_.logs[change.before], out_.logs[change.after], change.joint,
                                  std::abs(change.change_deg),
                                  std::min(std::abs(change.ci95_deg[0]), std::abs(change.ci95_deg[1])),
                                  std::max(std::abs(change.ci95_deg[0]), std::abs(change.ci95_deg[1])),
                                  change.change_deg > 0.0 ? "more" : "less"));
    }
    for (const auto& claim : out_.claims) {
      if (claim.judgement == Judgement::kAgrees) continue;
      const char* verb = claim.judgement == Judgement::kNothing   ? "cannot tell whether"
                         : claim.judgement == Judgement::kDiffers ? "has another size for what {} says:"
                                                                  : "contradicts {}:";
      parts.push_back(fmt::format("{} {} {} ({})", out_.logs[claim.judged_by],
                                  fmt::format(fmt::runtime(verb), out_.logs[claim.claimed_by]), claim.claim,
                                  claim.why));
    }
    if (parts.empty()) {
      out_.sentence = "Nothing was found in any of the logs, and no offset changed between them.";
      return;
    }
    for (const auto& part : parts) out_.sentence += (out_.sentence.empty() ? "" : " ") + part + ".";
  }

  const std::vector<DiagnosisReport>& reports_;
  const JointRoles& roles_;
  const std::vector<AcrossAxis>& across_;
  LogComparison& out_;
};

}  // namespace

const char* name_of(Judgement judgement) {
  switch (judgement) {
    case Judgement::kAgrees: return "agrees";
    case Judgement::kDiffers: return "differs";
    case Judgement::kContradicts: return "contradicts";
    case Judgement::kNothing: break;
  }
  return "says nothing";
}

LogComparison compare(const std::vector<DiagnosisReport>& reports, std::vector<std::string> logs,
                      const JointRoles& roles, const std::vector<AcrossAxis>& across) {
  LogComparison result;
  result.logs = std::move(logs);
  Comparison(reports, roles, across, result).run();
  return result;
}

std::string LogComparison::to_json() const {
  using Json = nlohmann::ordered_json;
  Json j = {{"logs", logs}, {"sentence", sentence}};
  j["common"] = Json::array();
  for (const auto& c : common) {
    Json entry = {{"cause", c.cause.cause.text()}, {"sentence", c.cause.sentence}, {"parameters", Json::array()}};
    for (const auto& p : c.cause.parameters) {
      entry["parameters"].push_back(
          {{"parameter", p.parameter}, {"unit", p.unit}, {"estimate", p.estimate}, {"ci95", p.ci95}});
    }
    for (const auto log : c.logs) entry["logs"].push_back(logs[log]);
    j["common"].push_back(std::move(entry));
  }
  j["claims"] = Json::array();
  for (const auto& c : claims) {
    j["claims"].push_back({{"claimed_by", logs[c.claimed_by]},
                           {"judged_by", logs[c.judged_by]},
                           {"cause", c.cause.text()},
                           {"judgement", name_of(c.judgement)},
                           {"why", c.why}});
  }
  j["offset_changes"] = Json::array();
  for (const auto& c : changes) {
    j["offset_changes"].push_back({{"from", logs[c.before]},
                                   {"to", logs[c.after]},
                                   {"joint", c.joint},
                                   {"change_deg", c.change_deg},
                                   {"ci95_deg", c.ci95_deg}});
  }
  j["offsets_not_compared"] = not_compared;
  return j.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";  // names of files may be no UTF-8
}

void LogComparison::write(const std::filesystem::path& directory) const {
  make_folder(directory);
  write_file(directory / "comparison.json", to_json());
  Report page("Diagnosis of several logs");
  page.verdict(sentence);
  if (!claims.empty()) {
    page.heading("What the logs say of each other's findings");
    std::vector<std::vector<std::string>> rows;
    for (const auto& c : claims) {
      rows.push_back({logs[c.claimed_by], c.claim, logs[c.judged_by], name_of(c.judgement), c.why});
    }
    page.table({"found in", "finding", "judged by", "which", "because of"}, rows);
  }
  page.heading("Joint offsets from log to log");
  if (changes.empty()) page.paragraph("No offset changed by more than chance and the logs' intervals allow.");
  if (!changes.empty()) {
    std::vector<std::vector<std::string>> rows;
    for (const auto& c : changes) {
      rows.push_back({logs[c.before], logs[c.after], c.joint, fmt::format("{:.2f}", c.change_deg),
                      fmt::format("{:.2f} to {:.2f}", c.ci95_deg[0], c.ci95_deg[1])});
    }
    page.table({"from", "to", "joint", "encoder - true, deg more", "95 % interval"}, rows);
  }
  if (!not_compared.empty()) {
    std::string list;
    for (const auto& joint : not_compared) list += (list.empty() ? "" : ", ") + joint;
    page.paragraph("Not compared, because a cause that only one of the logs has trades a constant with it: " + list +
                   ".");
  }
  page.paragraph("Each log has a folder of its own beside this page, with its report.html.");
  page.write(directory / "comparison.html");
}

}  // namespace bodyschema
