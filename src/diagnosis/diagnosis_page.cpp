#include "bodyschema/diagnosis/diagnosis_page.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <numeric>
#include <spdlog/fmt/fmt.h>

#include "bodyschema/core/rounded.hpp"
#include "residual_curve.hpp"

namespace bodyschema {
namespace {

using diagnosis::ErrorMemory;
using diagnosis::ResidualCurve;

constexpr std::size_t kBarsShown = 16;

using Value = std::function<double(const ResidualSample&)>;

std::vector<diagnosis::ResidualPoint> points_of(const DiagnosisReport& report, const Value& x, const Value& y) {
  std::vector<diagnosis::ResidualPoint> points;
  for (const auto& sample : report.samples) {
    if (sample.before.rms_px <= 0.0 || sample.after.rms_px <= 0.0) continue;
    points.push_back({x(sample), y(sample), sample.time_s, sample.camera});
  }
  return points;
}

double time_of(const ResidualSample& sample) {
  return sample.time_s;
}

ErrorMemory memory_of(const DiagnosisReport& report, const Value& y) {
  return diagnosis::error_memory(points_of(report, time_of, y));
}

ResidualCurve curve_of(const DiagnosisReport& report, const Value& x, const Value& y, const ErrorMemory& memory,
                       bool centred = true, std::size_t most_bins = diagnosis::kCurveBins) {
  return diagnosis::residual_curve(points_of(report, x, y), memory, centred, most_bins);
}

/// The report's colours.
enum Colour { kBlue = 0, kRed = 1, kGreen = 2, kOchre = 3 };

ChartSeries series_of(const std::string& name, const ResidualCurve& curve, Colour colour) {
  return {name, curve.x, curve.y, curve.low, curve.high, colour};
}

Chart curves(const std::string& title, const std::string& x, const std::string& y, std::vector<ChartSeries> series) {
  Chart chart;
  chart.title = title;
  chart.x_label = x;
  chart.y_label = y;
  chart.series = std::move(series);
  return chart;
}

/// A variable that what is left of a joint may follow.
struct Variable {
  std::string name;
  std::string axis;
  std::function<double(const ResidualSample&, std::size_t joint)> of;
};

const std::vector<Variable>& variables() {
  static const std::vector<Variable> list = {
      {"gravity torque", "Nm", [](const auto& s, std::size_t j) { return s.torque_nm[j]; }},
      {"angle", "deg", [](const auto& s, std::size_t j) { return s.angle_deg[j]; }},
      {"velocity", "deg/s", [](const auto& s, std::size_t j) { return s.velocity_deg_s[j]; }},
      {"speed", "deg/s", [](const auto& s, std::size_t j) { return std::abs(s.velocity_deg_s[j]); }},
      {"acceleration", "deg/s²",
       [](const auto& s, std::size_t j) { return j < s.acceleration_deg_s2.size() ? s.acceleration_deg_s2[j] : 0.0; }},
      {"time", "s", [](const auto& s, std::size_t) { return time_of(s); }}};
  return list;
}

using Which = Remainder ResidualSample::*;

Value apparent(std::size_t joint, Which which) {
  return [joint, which](const ResidualSample& s) { return (s.*which).apparent_deg[joint]; };
}

class Page {
 public:
  Page(const DiagnosisReport& report, const std::string& title) : d_(report), page_("Diagnosis: " + title) {
    // What an error in the model leaves stays alike as well; that is what the charts are to show.
    for (std::size_t j = 0; j < d_.arm_joints.size(); ++j) {
      memory_.push_back(memory_of(d_, apparent(j, &ResidualSample::noise)));
    }
  }

  Report write(const std::vector<std::pair<Image, std::string>>& pictures) {
    page_.verdict(d_.sentence);
    if (!d_.side_left_over.empty()) page_.paragraph("Left over: " + d_.side_left_over + ".");
    if (!d_.not_in_model.empty()) page_.paragraph("Not in the model: " + d_.not_in_model + ".");
    next_steps();
    causes();
    small_causes();
    estimated();
    gain();
    if (!pictures.empty()) {
      page_.heading("Where it shows");
      for (const auto& [image, caption] : pictures) page_.picture(image, caption);
    }
    candidates();
    if (!d_.samples.empty()) structure();
    offsets();
    limits();
    log();
    return std::move(page_);
  }

 private:
  static constexpr Which kBefore = &ResidualSample::before, kAfter = &ResidualSample::after;

  static std::string interval(const DiagnosedParameter& p) {
    if (!std::isfinite(p.ci95[0]) || !std::isfinite(p.ci95[1])) return "not known";
    const auto told = rounded(p.estimate, p.ci95[0], p.ci95[1]);
    return told.low + " to " + told.high;
  }

  static std::string size(const DiagnosedParameter& p) {
    return std::isfinite(p.ci95[0]) ? rounded(p.estimate, p.ci95[0], p.ci95[1]).value : roughly(p.estimate);
  }

  void causes() {
    if (d_.causes.empty()) return;
    page_.heading("What was found");
    std::vector<std::vector<std::string>> rows;
    for (const auto& cause : d_.causes) {
      const std::string name = cause.cause.name == "unexplained"
                                   ? "unexplained: follows the " + cause.variable + " of " + cause.cause.joint
                                   : cause.cause.text();
      if (cause.parameters.empty()) {
        rows.push_back(
            {name, "", "", "", fmt::format("{:.1f}", cause.z), fmt::format("{:.1f} %", 100 * cause.heldout_gain)});
      }
      for (std::size_t i = 0; i < cause.parameters.size(); ++i) {
        const auto& p = cause.parameters[i];
        const auto when = p.when(d_.begin_utime);
        rows.push_back({i == 0 ? name : "", p.parameter + (when.empty() ? "" : ", " + when),
                        size(p) + (p.unit == "1" ? "" : " " + p.unit), interval(p),
                        i == 0 ? fmt::format("{:.1f}", cause.z) : "",
                        i == 0 ? fmt::format("{:.1f} %", 100 * cause.heldout_gain) : ""});
      }
    }
    page_.table({"cause", "parameter", "estimate", "95 % interval", "z", "held-out gain"}, rows);
    for (const auto& cause : d_.causes) {
      if (cause.same.size() < 2) continue;
      std::string others;
      for (std::size_t i = 1; i < cause.same.size(); ++i) {
        others += (i == 1 ? "" : i + 1 == cause.same.size() ? " and " : ", ") + cause.same[i].text();
      }
      page_.paragraph("This log cannot tell " + cause.same.front().text() + " from " + others + ". " + cause.advice);
    }
  }

  void next_steps() {
    if (d_.next_steps.empty()) return;
    page_.heading("What to do next");
    page_.list(d_.next_steps);
  }

  void small_causes() {
    if (d_.small_causes.empty()) return;
    std::vector<std::string> items;
    for (const auto& cause : d_.small_causes) items.push_back(cause.sentence);
    page_.paragraph(fmt::format("Also in the extended model, though it moves hand and outlines by less than {:.2g} mm:",
                                d_.matters_mm));
    page_.list(items);
  }

  void estimated() {
    if (d_.estimated.empty()) return;
    std::vector<std::string> items;
    for (const auto& cause : d_.estimated) items.push_back(cause.sentence);
    page_.paragraph("Estimated in any case, and in the extended model:");
    page_.list(items);
  }

  void gain() {
    page_.heading(d_.causes.empty() ? "How well the model predicts" : "What the extension gains");
    const auto row = [](const char* name, double before, double after, const char* unit) {
      return std::vector<std::string>{name, fmt::format("{:.3f} {}", before, unit),
                                      fmt::format("{:.3f} {}", after, unit)};
    };
    const auto share = [](const char* name, double before, double after) {
      return std::vector<std::string>{name, fmt::format("{:.0f} %", 100.0 * before),
                                      fmt::format("{:.0f} %", 100.0 * after)};
    };
    page_.table(
        {"on parts of the log that the fit has not seen", "without the causes", "extended model"},
        {row("outline residual, rms", d_.before.rms_px, d_.after.rms_px, "px"),
         row("motion of the hand it asks for", d_.before.hand_mm, d_.after.hand_mm, "mm"),
         row("turn of the hand it asks for", d_.before.hand_deg, d_.after.hand_deg, "deg"),
         share("outline found, all pictures", d_.before.outline_found, d_.after.outline_found),
         share("outline found where the hand is seen", d_.before.outline_where_seen, d_.after.outline_where_seen)});
  }

  void offsets() {
    page_.heading("Joint offsets");
    std::vector<std::vector<std::string>> rows;
    for (const auto& joint : d_.arm_joints) {
      const auto before = d_.offsets_deg_before.find(joint);
      const auto after = d_.offsets_deg_after.find(joint);
      const auto ci = d_.offsets_ci95_deg.find(joint);
      if (before == d_.offsets_deg_before.end() || after == d_.offsets_deg_after.end()) continue;
      std::string width = "not known";
      if (ci != d_.offsets_ci95_deg.end() && std::isfinite(ci->second[0])) {
        width = fmt::format("{:.2f} to {:.2f}", ci->second[0], ci->second[1]);
      }
      rows.push_back({joint, fmt::format("{:.2f}", before->second), fmt::format("{:.2f}", after->second), width});
    }
    page_.table({"encoder - true, deg", "before", "after", "95 % interval"}, rows);
    page_.paragraph(
        "Compliance, gain, slip and drift trade a constant with the offset of their joint, so an offset "
        "may move while the joint's whole correction stays.");
  }

  void candidates() {
    auto bars = d_.bars;
    if (bars.empty()) return;
    page_.heading("All candidates");
    page_.paragraph(fmt::format(
        "How far each cause of the catalogue, and each free curve over what a joint does, stands out of the noise when "
        "it "
        "alone is added to the model: before, to the model of offsets and usual nuisances; after, to the extended one. "
        "The noise is judged by how the blocks of the log differ. Of all candidates together, chance alone reaches "
        "z = {:.1f} in one log of a hundred; a cause must exceed it, and move the hand or the outlines by what "
        "matters.",
        d_.z_threshold));
    std::stable_sort(bars.begin(), bars.end(), [](const auto& a, const auto& b) { return a.z_before > b.z_before; });
    const auto draw = [&](std::size_t from, std::size_t to, const std::string& title) {
      Chart chart;
      chart.kind = Chart::Kind::kBar;
      chart.horizontal = true;
      chart.title = title;
      chart.y_label = "z";
      chart.threshold = d_.z_threshold;
      chart.threshold_name = fmt::format("threshold {:.1f}", d_.z_threshold);
      chart.series = {{.name = "before", .colour = kRed}, {.name = "after", .colour = kBlue}};
      for (std::size_t i = from; i < to; ++i) {
        chart.labels.push_back(bars[i].label);
        chart.series[0].y.push_back(bars[i].z_before);
        chart.series[1].y.push_back(bars[i].z_after);
      }
      page_.chart(chart);
    };
    const std::size_t first = std::min(kBarsShown, bars.size());
    draw(0, first, fmt::format("the {} strongest of {} candidates", first, bars.size()));
    if (bars.size() == first) return;
    page_.begin_details(fmt::format("The other {} candidates", bars.size() - first));
    draw(first, bars.size(), "all others");
    page_.end();
  }

  // ---- structure of what is left ----

  void structure() {
    page_.heading("What is left, and what it follows");
    page_.paragraph(
        "Every picture asks for a small correction of each joint alone. Without an error in the model these are "
        "noise about zero; a line that follows something names an error. Lines are medians over equally many "
        "pictures, bands their 95 % intervals (pictures that err alike count as fewer); red with offsets and usual "
        "nuisances, blue with the extended model, both predicted for blocks that the fit had not seen. What the "
        "answer calls unexplained comes first. Of several joints the one is shown that follows its variable most "
        "clearly: where nothing is wrong, the one that chance moved most.");
    page_.begin_grid();
    for (const auto& cause : d_.causes) {
      if (!cause.variable.empty()) chart_of_unexplained(cause);
    }
    for (const auto& variable : variables()) chart_of(variable);
    direction_of_motion();
    other_joints();
    over_pictures();
    page_.end();
    all_structure();
  }

  [[nodiscard]] bool known(const Variable& variable) const {
    return std::any_of(d_.samples.begin(), d_.samples.end(), [&](const ResidualSample& s) {
      for (std::size_t j = 0; j < d_.arm_joints.size(); ++j) {
        if (variable.of(s, j) != 0.0) return true;
      }
      return false;
    });
  }

  /// What the sentence names, be another joint's curve stronger or not. A curve in time may have two dozen periods
  /// in a log, whatever its length: as many points as show each of them.
  void chart_of_unexplained(const DiagnosedCause& cause) {
    constexpr std::size_t kBinsOverTime = 24 * 5;
    const auto& all = variables();
    const auto variable = std::find_if(all.begin(), all.end(), [&](const Variable& v) {
      return v.name == cause.variable || (v.name == "gravity torque" && cause.variable == "torque");
    });
    const auto joint = std::find(d_.arm_joints.begin(), d_.arm_joints.end(), cause.cause.joint);
    if (variable == all.end() || joint == d_.arm_joints.end()) return;
    const std::size_t bins = variable->name == "time" ? kBinsOverTime : diagnosis::kCurveBins;
    chart_of(*variable, static_cast<std::size_t>(joint - d_.arm_joints.begin()), " (named above)", bins);
  }

  void chart_of(const Variable& variable) {
    if (!known(variable)) return;
    std::size_t strongest = 0;
    double most = -1.0;
    for (std::size_t j = 0; j < d_.arm_joints.size(); ++j) {
      const double strength = curve(j, variable, kBefore).structure();
      if (strength > most) {
        most = strength;
        strongest = j;
      }
    }
    chart_of(variable, strongest, strongest_of(d_.arm_joints.size(), "joints"), diagnosis::kCurveBins);
  }

  void chart_of(const Variable& variable, std::size_t joint, const std::string& why, std::size_t bins) {
    page_.chart(
        curves(d_.arm_joints[joint] + (variable.name == "time" ? " over " : " against its ") + variable.name + why,
               variable.name + ", " + variable.axis, "correction asked for, deg",
               before_and_after(curve(joint, variable, kBefore, bins), curve(joint, variable, kAfter, bins))));
  }

  static std::string strongest_of(std::size_t count, const char* what) {
    return count > 1 ? fmt::format(" (strongest of {} {})", count, what) : "";
  }

  [[nodiscard]] ResidualCurve curve(std::size_t joint, const Variable& variable, Which which,
                                    std::size_t bins = diagnosis::kCurveBins) const {
    return curve_of(
        d_, [&](const ResidualSample& s) { return variable.of(s, joint); }, apparent(joint, which), memory_[joint],
        true, bins);
  }

  static std::vector<ChartSeries> before_and_after(const ResidualCurve& before, const ResidualCurve& after) {
    return {series_of("before", before, kRed), series_of("extended", after, kBlue)};
  }

  /// The same angles on the way up and on the way down: backlash opens a gap between them.
  void direction_of_motion() {
    constexpr double kMoving_deg_s = 2.0;
    const auto one_way = [&](std::size_t j, double sign, Which which) {
      return curve_of(
          d_, [j](const ResidualSample& s) { return s.angle_deg[j]; },
          [&, j](const ResidualSample& s) {
            return sign * s.velocity_deg_s[j] > kMoving_deg_s ? apparent(j, which)(s) : std::nan("");
          },
          memory_[j], false);
    };
    std::size_t widest = 0;
    double most = -1.0;
    for (std::size_t j = 0; j < d_.arm_joints.size(); ++j) {
      const auto up = one_way(j, 1.0, kBefore), down = one_way(j, -1.0, kBefore);
      if (up.y.empty() || down.y.empty()) continue;
      const auto mean = [](const ResidualCurve& c) {
        return std::accumulate(c.y.begin(), c.y.end(), 0.0) / static_cast<double>(c.y.size());
      };
      const auto noise = [](const ResidualCurve& c) {
        double sum = 0.0;
        for (const double sd : c.sd) sum += sd * sd;
        return sum / std::pow(static_cast<double>(c.y.size()), 2);
      };
      const double strength = std::abs(mean(up) - mean(down)) / std::sqrt(noise(up) + noise(down) + 1e-12);
      if (strength > most) {
        most = strength;
        widest = j;
      }
    }
    if (most < 0.0) return;
    page_.chart(
        curves(d_.arm_joints[widest] + ", rising against falling" + strongest_of(d_.arm_joints.size(), "joints"),
               "angle, deg", "correction asked for, deg",
               {series_of("rising, before", one_way(widest, 1.0, kBefore), kRed),
                series_of("falling, before", one_way(widest, -1.0, kBefore), kOchre),
                series_of("rising, extended", one_way(widest, 1.0, kAfter), kBlue),
                series_of("falling, extended", one_way(widest, -1.0, kAfter), kGreen)}));
  }

  void other_joints() {
    std::size_t follower = 0, leader = 0;
    double most = -1.0;
    const auto pair = [&](std::size_t i, std::size_t j, Which which) {
      return curve_of(
          d_, [j](const ResidualSample& s) { return s.angle_deg[j]; }, apparent(i, which), memory_[i]);
    };
    for (std::size_t i = 0; i < d_.arm_joints.size(); ++i) {
      for (std::size_t j = 0; j < d_.arm_joints.size(); ++j) {
        if (i == j) continue;
        const double strength = pair(i, j, kBefore).structure();
        if (strength > most) {
          most = strength;
          follower = i;
          leader = j;
        }
      }
    }
    if (most < 0.0) return;
    const auto pairs = d_.arm_joints.size() * (d_.arm_joints.size() - 1);
    page_.chart(curves(
        d_.arm_joints[follower] + " against another joint: " + d_.arm_joints[leader] + strongest_of(pairs, "pairs"),
        d_.arm_joints[leader] + ", deg", "correction asked for, deg",
        before_and_after(pair(follower, leader, kBefore), pair(follower, leader, kAfter))));
  }

  void over_pictures() {
    const auto both = [&](const Value& x, double Remainder::*figure) {
      const auto of = [figure](Which which) {
        return [figure, which](const ResidualSample& s) { return s.*which.*figure; };
      };
      const auto memory = memory_of(d_, of(&ResidualSample::noise));
      return before_and_after(curve_of(d_, x, of(kBefore), memory, false), curve_of(d_, x, of(kAfter), memory, false));
    };
    constexpr auto kRms = &Remainder::rms_px, kMean = &Remainder::mean_px;
    page_.chart(curves("outline residual over time", "time, s", "rms, px", both(time_of, kRms)));
    if (std::none_of(d_.samples.begin(), d_.samples.end(), [](const auto& s) { return s.depth_m > 0.0; })) return;
    const Value radius = [](const ResidualSample& s) { return s.image_radius_px; };
    const Value depth = [](const ResidualSample& s) { return s.depth_m; };
    page_.chart(curves("outline against image radius", "hand from the picture's centre, px",
                       "mean along the outward normal, px", both(radius, kMean)));
    page_.chart(curves("outline against depth", "hand from the eye, m", "mean along the outward normal, px",
                       both(depth, kMean)));
    page_.chart(curves("residual against depth", "hand from the eye, m", "rms, px", both(depth, kRms)));
  }

  void all_structure() {
    std::vector<std::string> head = {"deg, before > after"};
    for (const auto& variable : variables()) {
      if (known(variable)) head.push_back(variable.name);
    }
    std::vector<std::vector<std::string>> rows;
    for (std::size_t j = 0; j < d_.arm_joints.size(); ++j) {
      std::vector<std::string> row = {d_.arm_joints[j]};
      for (const auto& variable : variables()) {
        if (!known(variable)) continue;
        row.push_back(
            fmt::format("{:.2f} > {:.2f}", curve(j, variable, kBefore).size(), curve(j, variable, kAfter).size()));
      }
      rows.push_back(std::move(row));
    }
    page_.begin_details("Every joint against every variable, as numbers");
    page_.paragraph("Root mean square of what follows the variable, its noise taken off.");
    page_.table(head, rows);
    page_.end();
  }

  // ---- what the log is good for ----

  void limits() {
    page_.heading("What this log cannot test");
    if (d_.not_testable.empty()) page_.paragraph("Every cause of the catalogue can be tested with it.");
    std::map<std::string, std::vector<std::string>> by_reason;
    std::vector<std::string> reasons;
    for (const auto& item : d_.not_testable) {
      if (by_reason.find(item.reason) == by_reason.end()) reasons.push_back(item.reason);
      by_reason[item.reason].push_back(item.cause.text());
    }
    std::vector<std::string> items;
    for (const auto& reason : reasons) {
      std::string list;
      for (const auto& cause : by_reason[reason]) list += (list.empty() ? "" : ", ") + cause;
      items.push_back(reason + ": " + list);
    }
    if (!items.empty()) page_.list(items);
    if (d_.exclusion_limits.empty()) return;
    std::vector<std::vector<std::string>> rows;
    for (const auto& limit : d_.exclusion_limits) {
      rows.push_back({limit.cause.text(), limit.parameter,
                      fmt::format("{:.3g}{}", limit.limit, limit.unit == "1" ? "" : " " + limit.unit)});
    }
    page_.begin_details(fmt::format("What it excludes: {} limits", rows.size()));
    page_.paragraph("With 95 % confidence these causes are smaller than:");
    page_.table({"cause", "parameter", "at most"}, rows);
    page_.end();
  }

  void log() {
    page_.heading("The log");
    std::vector<std::string> items = {fmt::format("{:.1f} s, {} pictures used, {} blocks of {:.1f} s", d_.duration_s,
                                                  d_.views, d_.blocks, d_.block_s)};
    items.insert(items.end(), d_.warnings.begin(), d_.warnings.end());
    page_.list(items);
    page_.paragraph(
        "extended_model.yaml beside this page holds the extended model. bodyschemad, bodyschema replay and "
        "bodyschema export take it with --extended-model.");
  }

  const DiagnosisReport& d_;
  Report page_;
  std::vector<ErrorMemory> memory_;  ///< per arm joint, of what the extended model leaves
};

}  // namespace

Report diagnosis_page(const DiagnosisReport& diagnosis, const std::string& title,
                      const std::vector<std::pair<Image, std::string>>& pictures) {
  return Page(diagnosis, title).write(pictures);
}

}  // namespace bodyschema
