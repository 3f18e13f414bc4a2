#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numeric>

#include "diagnosis_trials.hpp"

/// How often the diagnosis is right, on logs of rendered pictures in which the simulator's physics hides faults. Faults
/// come in all sizes; what a fault is worth is measured on the log: how far it moves hand and outlines when the joints'
/// offsets and the usual nuisances are fitted as well as they can be.
namespace bodyschema {
namespace {

using namespace diagnosis_trials;

constexpr double kMedian = 0.5, kNinth = 0.9;

/// Sizes of single parameters that were found, against the truth.
struct Sizes {
  std::vector<double> error;  ///< relative
  std::vector<double> ratio;  ///< error over half the width of the 95 % interval
  int right_sign = 0;
  /// Share of the truths within so many half widths.
  [[nodiscard]] double inside(double widths) const {
    if (ratio.empty()) return std::nan("");
    const auto count = std::count_if(ratio.begin(), ratio.end(), [&](double r) { return r <= widths; });
    return static_cast<double>(count) / static_cast<double>(ratio.size());
  }
};

void add_size(const Record& o, Sizes& sizes) {
  for (const auto& size : o.sizes) {
    const double off = std::abs(size.estimate - size.truth);
    sizes.error.push_back(off / std::abs(size.truth));
    sizes.ratio.push_back(off / std::max(1e-12, 0.5 * size.width));
    sizes.right_sign += size.estimate * size.truth > 0.0;
  }
}

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return std::nan("");
  std::sort(values.begin(), values.end());
  return values[std::min(values.size() - 1, static_cast<std::size_t>(share * static_cast<double>(values.size())))];
}

/// One line of the table: a rate over some outcomes, with what is demanded.
class Table {
 public:
  Table(ExperimentContext& context) : context_(context) {
    context_.table += fmt::format("\n{:<44} {:>6} {:>9}   {}\n",
                                  context_.options.masks ? "masks, 40 s at 5 Hz" : "through pictures, 60 s at 10 Hz",
                                  "logs", "measured", "demand");
  }
  void add(const char* row, const char* name, std::size_t logs, double value, double demand, bool at_most,
           double upper = 1e9) {
    context_.summary[row][name] = std::isfinite(value) ? Json(value) : Json(nullptr);
    context_.summary[row]["trials"] = logs;
    if (!std::isfinite(value)) return;
    constexpr double kRounding = 1e-9;
    const bool met = at_most ? value <= demand + kRounding : value >= demand - kRounding && value <= upper + kRounding;
    const auto text = upper < 1e8 ? fmt::format("{:.2f} to {:.2f}", demand, upper)
                                  : fmt::format("{} {:.2f}", at_most ? "at most" : "at least", demand);
    context_.table += fmt::format("{:<44} {:>6} {:>9.3f}   {:<14} {}\n", fmt::format("{} {}", row, name), logs, value,
                                  text, met ? "" : "missed");
  }

 private:
  ExperimentContext& context_;
};

/// The first of its faults.
bool in_class(const Record& o) {
  return o.found.at(0);
}

template <class Test>
double rate(const std::vector<const Record*>& outcomes, Test test) {
  if (outcomes.empty()) return std::nan("");
  const auto hits =
      std::count_if(outcomes.begin(), outcomes.end(), [&](const Record* o) { return std::invoke(test, *o); });
  return static_cast<double>(hits) / static_cast<double>(outcomes.size());
}

void add_curve(ExperimentContext& context, const std::vector<const Record*>& single) {
  // By the larger of mm at the hand over 2 mm and px of outline over 1 px.
  constexpr std::array<double, 7> kEdges = {0.0, 0.125, 0.25, 0.5, 1.0, 2.0, 1e9};
  context.table += fmt::format("\n{:<44} {:>6} {:>9} {:>9} {:>9}\n", "size, of what matters (2 mm or 1 px)", "logs",
                               "first", "in class", "wrong");
  for (std::size_t i = 0; i + 1 < kEdges.size(); ++i) {
    std::vector<const Record*> in;
    for (const auto* o : single) {
      if (o->size() >= kEdges[i] && o->size() < kEdges[i + 1]) in.push_back(o);
    }
    if (in.empty()) continue;
    const double first = rate(in, &Record::first), off = rate(in, &Record::wrong), named = rate(in, in_class);
    const auto label =
        kEdges[i + 1] < 1e8 ? fmt::format("{} to {}", kEdges[i], kEdges[i + 1]) : fmt::format("{} and more", kEdges[i]);
    context.table += fmt::format("{:<44} {:>6} {:>9.2f} {:>9.2f} {:>9.2f}\n", label, in.size(), first, named, off);
    context.summary["detection"].push_back(
        {{"from", kEdges[i]}, {"logs", in.size()}, {"first", first}, {"in_class", named}, {"wrong", off}});
  }
}

void add_sizes(Table& table, const Sizes& sizes) {
  const auto n = sizes.error.size();
  table.add("parameters", "coverage95", n, sizes.inside(1.0), 0.90, false, 0.99);
  table.add("parameters", "error_median", n, quantile(sizes.error, kMedian), 0.04, true);
  table.add("parameters", "error_p90", n, quantile(sizes.error, kNinth), 0.15, true);
  table.add("parameters", "sign_rate", n,
            n > 0 ? static_cast<double>(sizes.right_sign) / static_cast<double>(n) : std::nan(""), 1.0, false);
}

/// Of the intervals: what share of the truths lies within so much of their width.
void add_reliability(ExperimentContext& context, const Sizes& sizes) {
  context.table += fmt::format("\n{:<44} {:>6}\n", "interval narrowed or widened by", "holds");
  for (const double widths : {0.34, 0.65, 1.0, 1.5, 2.0}) {
    context.table += fmt::format("{:<44} {:>6.2f}\n", widths, sizes.inside(widths));
    context.summary["reliability"].push_back({{"widths", widths}, {"holds", sizes.inside(widths)}});
  }
}

/// What healthy logs of one of the robots leave, px: median.
double noise_of(const std::vector<Record>& outcomes, bool official) {
  std::vector<double> noise, any;
  for (const auto& o : outcomes) {
    if (o.row != kNull) continue;
    any.push_back(o.size_px);
    if (o.official == official) noise.push_back(o.size_px);
  }
  return quantile(noise.empty() ? any : noise, kMedian);
}

}  // namespace

void run_diagnosis(ExperimentContext& context) {
  std::vector<Record> outcomes;
  for (const auto& line : run(context)) outcomes.push_back(record_of(line));
  const std::array<double, 2> noise_px = {noise_of(outcomes, false), noise_of(outcomes, true)};
  std::array<std::vector<const Record*>, kRows> rows;
  std::vector<const Record*> single, limit;
  Sizes sizes;
  std::vector<double> gain, took_s;
  for (auto& o : outcomes) {
    const double noise = noise_px[o.official];
    o.size_px = std::sqrt(std::max(0.0, o.size_px * o.size_px - noise * noise));
    rows[o.row].push_back(&o);
    took_s.push_back(o.seconds);
    if (o.row == kSingle && o.size() >= 1.0) single.push_back(&o);
    if (o.row == kSingle && o.size() >= 0.25 && o.size() < 0.5) limit.push_back(&o);
    if (o.row == kSingle || o.row == kTwo) add_size(o, sizes);
    if (o.row == kSingle && o.size() >= 1.0 && o.size_mm > 0.0) gain.push_back(o.size_mm / std::max(1e-6, o.left_mm));
  }

  Table table(context);
  table.add("null", "false_alarm_rate", rows[kNull].size(), rate(rows[kNull], &Record::named), 0.04, true);
  // Small errors of nine kinds at once: none of them stands for the rest.
  table.add("background", "named_large_rate", rows[kBackground].size(), rate(rows[kBackground], &Record::large_gain),
            0.05, true);
  table.add("single", "in_class_rate", single.size(), rate(single, in_class), 0.95, false);
  table.add("single", "first_rate", single.size(), rate(single, &Record::first), 0.88, false);
  table.add("single", "wrong_rate", single.size(), rate(single, &Record::wrong), 0.02, true);
  table.add("limit", "wrong_rate", limit.size(), rate(limit, &Record::wrong), 0.05, true);
  table.add("two", "both_rate", rows[kTwo].size(),
            rate(rows[kTwo], [](const Record& o) { return o.found.at(0) && o.found.at(1); }), 0.88, false);
  table.add("two", "wrong_rate", rows[kTwo].size(), rate(rows[kTwo], &Record::wrong), 0.02, true);
  table.add("outside", "unexplained_rate", rows[kOutside].size(), rate(rows[kOutside], &Record::not_explained_away),
            0.90, false);
  table.add("outside", "none_rate", rows[kOutside].size(),
            rate(rows[kOutside], [](const Record& o) { return o.verdict == "none"; }), 0.0, true);
  add_sizes(table, sizes);
  table.add("gain", "hand_improvement_median", gain.size(), quantile(gain, kMedian), 3.0, false);
  add_curve(context, rows[kSingle]);
  add_reliability(context, sizes);
  if (took_s.empty()) return;
  const double all_s = std::accumulate(took_s.begin(), took_s.end(), 0.0);
  context.summary["seconds_a_log"] = all_s / static_cast<double>(took_s.size());
  context.table += fmt::format("\n{} logs, {:.1f} s of processor time each on average\n", took_s.size(),
                               all_s / static_cast<double>(took_s.size()));
}

}  // namespace bodyschema
