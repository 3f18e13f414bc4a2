#include <spdlog/fmt/fmt.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <fstream>
#include <map>
#include <mutex>
#include <thread>

#include "bodyschema/bus/log.hpp"
#include "bodyschema/core/error.hpp"
#include "bodyschema/core/progress_bar.hpp"
#include "bodyschema/core/write_file.hpp"
#include "bodyschema/diagnosis/log_diagnosis.hpp"
#include "bodyschema/simulator/random.hpp"
#include "bodyschema/simulator/recording.hpp"
#include "experiments.hpp"

/// How often the diagnosis is right, on logs of rendered pictures in which the simulator's physics hides faults. Faults
/// come in all sizes; what a fault is worth is measured on the log: how far it moves hand and outlines when the joints'
/// offsets and the usual nuisances are fitted as well as they can be.
namespace bodyschema {
namespace {

namespace fs = std::filesystem;

constexpr double kLog_s = 60.0, kPictureRate_hz = 10.0;
/// A cause of this size is one that a user wants to know; those at the limit have a quarter to a half of it.
constexpr double kMatters_mm = 2.0, kMatters_px = 1.0;
constexpr double kMedian = 0.5, kNinth = 0.9;

enum Row { kNull, kSingle, kTwo, kOutside, kRows };
/// For 60 logs with one cause. Those come in all sizes, so that of more of them some are at the limit.
constexpr std::array<double, kRows> kLogsOf60 = {100, 90, 25, 20};
constexpr std::array<const char*, kRows> kNames = {"null", "single", "two", "outside"};

using HandTruth = std::map<std::pair<Microseconds, std::size_t>, Eigen::Vector3d>;

struct Outcome {
  Row row = kNull;
  std::uint64_t seed = 0;
  std::vector<simulator::FaultSpec> faults;
  DiagnosisReport report;
  double size_mm = 0.0, size_px = 0.0;  ///< of the faults, offsets and nuisances fitted
  double left_mm = 0.0;                 ///< of the hand's error under the extended model
  [[nodiscard]] double size() const { return std::max(size_mm / kMatters_mm, size_px / kMatters_px); }
};

bool same(const simulator::FaultSpec& fault, const CauseName& cause) {
  const auto argument = [&](const char* key) {
    const auto at = fault.arguments.find(key);
    return at == fault.arguments.end() ? std::string() : at->second;
  };
  if (fault.name != cause.name || argument("joint") != cause.joint) return false;
  return argument("source").empty() || argument("source") == cause.source;
}

bool in_class(const simulator::FaultSpec& fault, const DiagnosedCause& cause) {
  return std::any_of(cause.same.begin(), cause.same.end(), [&](const auto& c) { return same(fault, c); });
}

bool found(const Outcome& o, const simulator::FaultSpec& fault) {
  return std::any_of(o.report.causes.begin(), o.report.causes.end(), [&](const auto& c) { return in_class(fault, c); });
}

/// Something is named that is not there.
bool wrong(const Outcome& o) {
  if (o.report.verdict != "named" && o.report.verdict != "class") return false;
  return std::any_of(o.report.causes.begin(), o.report.causes.end(), [&](const DiagnosedCause& c) {
    return std::none_of(o.faults.begin(), o.faults.end(), [&](const auto& fault) { return in_class(fault, c); });
  });
}

double hand_error_mm(const DiagnosisReport& report, const HandTruth& truth, Remainder ResidualSample::*which) {
  double square = 0.0, n = 0.0;
  for (const auto& sample : report.samples) {
    const auto at = truth.find({sample.utime, sample.camera});
    if (at == truth.end() || (sample.*which).rms_px <= 0.0) continue;
    square += ((sample.*which).hand_C_m - at->second).squaredNorm();
    n += 1.0;
  }
  return n > 0.0 ? 1e3 * std::sqrt(square / n) : 0.0;
}

class Trials {
 public:
  explicit Trials(ExperimentContext& context)
      : context_(context), setup_(RobotSetup::from(context.simulated.section("robot"))),
        rig_(StereoRig::from(context.simulated.section("cameras"))), robot_(load_robot(setup_, rig_)),
        settings_(simulator::SimulatorSettings::from(context.simulated.section("simulator"))),
        configuration_(context.recorded / "icub_right" / "estimator.yaml") {
    settings_.camera_rate_hz = kPictureRate_hz;
  }

  std::vector<Outcome> run() {
    std::vector<std::pair<Row, std::uint64_t>> jobs;
    for (int row = 0; row < kRows; ++row) {
      const auto count =
          std::max(1L, std::lround(kLogsOf60[static_cast<std::size_t>(row)] * context_.options.trials / 60.0));
      for (long i = 0; i < count; ++i) {
        jobs.emplace_back(static_cast<Row>(row), context_.options.seed + 1000u * static_cast<std::uint64_t>(row) +
                                                     static_cast<std::uint64_t>(i));
      }
    }
    std::vector<Outcome> outcomes(jobs.size());
    ProgressBar bar("logs with hidden faults", jobs.size());
    std::atomic<std::size_t> next{0}, done{0};
    std::mutex mutex;
    std::exception_ptr failure;
    const auto work = [&] {
      for (std::size_t i; (i = next++) < jobs.size();) {
        try {
          outcomes[i] = one(jobs[i].first, jobs[i].second);
        } catch (...) {
          const std::scoped_lock lock(mutex);
          failure = std::current_exception();
          next = jobs.size();
        }
        const std::scoped_lock lock(mutex);
        bar.set(++done);
      }
    };
    const int wanted = context_.options.threads > 0
                           ? context_.options.threads
                           : static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
    std::vector<std::jthread> threads;
    for (int t = 1; t < wanted; ++t) threads.emplace_back(work);
    work();
    threads.clear();
    if (failure) std::rethrow_exception(failure);
    return outcomes;
  }

 private:
  std::vector<simulator::FaultSpec> draw(Row row, std::uint64_t seed) const {
    simulator::FaultSite site(robot_, setup_, rig_);
    site.begin_s = 0.0;
    site.end_s = kLog_s;
    simulator::DrawOptions options;
    options.outside_catalogue = row == kOutside;
    std::vector<simulator::FaultSpec> faults;
    simulator::Random random(seed, "size of the fault");
    // Single causes of all sizes, from invisible to gross; of several, those that are well seen alone.
    const double lowest = row == kSingle ? 0.3 : 4.0, highest = row == kSingle ? 15.0 : 10.0;
    const int count = row == kNull ? 0 : row == kTwo ? 2 : 1;
    for (int i = 0; i < count; ++i) {
      options.multiple_of_detectable = lowest * std::pow(highest / lowest, random.uniform(0.0, 1.0));
      faults.push_back(simulator::draw_fault(seed + 100000u * static_cast<std::uint64_t>(i), site, options));
      options.exclude.push_back(faults.back().name);
    }
    return faults;
  }

  Outcome one(Row row, std::uint64_t seed) const {
    static std::atomic<int> number{0};
    const auto file = fs::temp_directory_path() / fmt::format("bodyschema_{}_diagnosis_{}.log", getpid(), number++);
    Outcome outcome;
    outcome.row = row;
    outcome.seed = seed;
    outcome.faults = draw(row, seed);
    simulator::SimulationPlan plan;
    plan.seed = seed;
    plan.motion = simulator::Motion::kBabble;
    plan.seconds = kLog_s;
    plan.faults = outcome.faults;
    simulator::Random random(seed, "offsets");
    for (const auto& joint : setup_.estimated_joints) plan.offsets_deg[joint] = random.uniform(-7.0, 7.0);
    HandTruth truth;
    {
      simulator::Simulator simulator(robot_, setup_, rig_, settings_, plan);
      LogWriter log(file);
      simulator::FramePublisher publisher(simulator.joint_names(), {});
      while (const auto frame = simulator.next()) {
        publisher.publish(*frame, log);
        for (std::size_t c = 0; c < frame->cameras.size(); ++c) {
          if (frame->cameras[c]) truth[{frame->cameras[c]->utime, c}] = frame->truth[c].X_CP.translation();
        }
      }
    }
    LogDiagnosisOptions options;
    options.log = file;
    options.picture_rate_hz = kPictureRate_hz;
    options.threads = 1;  // other logs run beside this one
    options.quiet = true;
    outcome.report = diagnose_log(Configuration::load(configuration_), options);
    std::error_code error;
    fs::remove(file, error);
    outcome.size_mm = hand_error_mm(outcome.report, truth, &ResidualSample::before);
    outcome.left_mm = hand_error_mm(outcome.report, truth, &ResidualSample::after);
    outcome.size_px = outcome.report.before.rms_px;  // the noise of healthy logs comes off once that is known
    return outcome;
  }

  ExperimentContext& context_;
  RobotSetup setup_;
  StereoRig rig_;
  std::shared_ptr<const RobotModel> robot_;
  simulator::SimulatorSettings settings_;
  fs::path configuration_;
};

/// Sizes of single parameters that were found, against the truth.
struct Sizes {
  std::vector<double> error;  ///< relative
  std::vector<double> ratio;  ///< error over half the width of the 95 % interval
  int right_sign = 0;
};

void add_size(const Outcome& o, Sizes& sizes) {
  for (const auto& fault : o.faults) {
    for (const auto& cause : o.report.causes) {
      if (!same(fault, cause.cause) || cause.parameters.size() != 1 || fault.value() == 0.0) continue;
      const auto& p = cause.parameters.front();
      const double off = std::abs(p.estimate - fault.value());
      sizes.error.push_back(off / std::abs(fault.value()));
      sizes.ratio.push_back(off / std::max(1e-12, 0.5 * (p.ci95[1] - p.ci95[0])));
      sizes.right_sign += p.estimate * fault.value() > 0.0;
    }
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
    context_.table +=
        fmt::format("\n{:<44} {:>6} {:>9}   {}\n", "through pictures, 60 s at 10 Hz", "logs", "measured", "demand");
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

template <class Test>
double rate(const std::vector<const Outcome*>& outcomes, Test test) {
  if (outcomes.empty()) return std::nan("");
  const auto hits = std::count_if(outcomes.begin(), outcomes.end(), [&](const Outcome* o) { return test(*o); });
  return static_cast<double>(hits) / static_cast<double>(outcomes.size());
}

void add_curve(ExperimentContext& context, const std::vector<const Outcome*>& single) {
  // By the larger of mm at the hand over 2 mm and px of outline over 1 px.
  constexpr std::array<double, 7> kEdges = {0.0, 0.125, 0.25, 0.5, 1.0, 2.0, 1e9};
  context.table += fmt::format("\n{:<44} {:>6} {:>9} {:>9} {:>9}\n", "size, of what matters (2 mm or 1 px)", "logs",
                               "first", "in class", "wrong");
  for (std::size_t i = 0; i + 1 < kEdges.size(); ++i) {
    std::vector<const Outcome*> in;
    for (const auto* o : single) {
      if (o->size() >= kEdges[i] && o->size() < kEdges[i + 1]) in.push_back(o);
    }
    if (in.empty()) continue;
    const double first = rate(in, [](const Outcome& o) {
      return !o.report.causes.empty() && same(o.faults.front(), o.report.causes.front().cause);
    });
    const double named = rate(in, [](const Outcome& o) { return found(o, o.faults.front()); });
    const double off = rate(in, wrong);
    const auto label =
        kEdges[i + 1] < 1e8 ? fmt::format("{} to {}", kEdges[i], kEdges[i + 1]) : fmt::format("{} and more", kEdges[i]);
    context.table += fmt::format("{:<44} {:>6} {:>9.2f} {:>9.2f} {:>9.2f}\n", label, in.size(), first, named, off);
    context.summary["detection"].push_back(
        {{"from", kEdges[i]}, {"logs", in.size()}, {"first", first}, {"in_class", named}, {"wrong", off}});
  }
}

Json json_of(const Outcome& o) {
  Json faults = Json::array(), answer = Json::array();
  for (const auto& fault : o.faults) faults.push_back(fault.text());
  for (const auto& c : o.report.causes)
    answer.push_back({{"sentence", c.sentence}, {"class", c.same.size()}, {"z", c.z}});
  return {{"row", kNames[o.row]},        {"seed", o.seed},       {"faults", faults},     {"answer", answer},
          {"verdict", o.report.verdict}, {"size_mm", o.size_mm}, {"size_px", o.size_px}, {"left_mm", o.left_mm}};
}

}  // namespace

void run_diagnosis(ExperimentContext& context) {
  auto outcomes = Trials(context).run();
  std::vector<double> noise;
  for (const auto& o : outcomes) {
    if (o.row == kNull) noise.push_back(o.size_px);
  }
  const double noise_px = quantile(noise, kMedian);
  std::array<std::vector<const Outcome*>, kRows> rows;
  std::vector<const Outcome*> single, limit;
  Sizes sizes;
  std::vector<double> gain;
  std::string lines;
  for (auto& o : outcomes) {
    o.size_px = std::sqrt(std::max(0.0, o.size_px * o.size_px - noise_px * noise_px));
    rows[o.row].push_back(&o);
    lines += json_of(o).dump() + '\n';
    if (o.row == kSingle && o.size() >= 1.0) single.push_back(&o);
    if (o.row == kSingle && o.size() >= 0.25 && o.size() < 0.5) limit.push_back(&o);
    if (o.row == kSingle || o.row == kTwo) add_size(o, sizes);
    if (o.row == kSingle && o.size() >= 1.0 && o.size_mm > 0.0) gain.push_back(o.size_mm / std::max(1e-6, o.left_mm));
  }
  replace_file(context.options.out / "trials.jsonl", lines);

  Table table(context);
  const auto named = [](const Outcome& o) { return !o.report.causes.empty(); };
  table.add("null", "false_alarm_rate", rows[kNull].size(), rate(rows[kNull], named), 0.04, true);
  table.add("single", "in_class_rate", single.size(), rate(single, [](const auto& o) { return found(o, o.faults[0]); }),
            0.95, false);
  table.add("single", "first_rate", single.size(),
            rate(single,
                 [](const auto& o) { return !o.report.causes.empty() && same(o.faults[0], o.report.causes[0].cause); }),
            0.88, false);
  table.add("single", "wrong_rate", single.size(), rate(single, wrong), 0.02, true);
  table.add("limit", "wrong_rate", limit.size(), rate(limit, wrong), 0.05, true);
  table.add("two", "both_rate", rows[kTwo].size(),
            rate(rows[kTwo],
                 [](const auto& o) {
                   return std::all_of(o.faults.begin(), o.faults.end(), [&](const auto& f) { return found(o, f); });
                 }),
            0.88, false);
  table.add("outside", "unexplained_rate", rows[kOutside].size(),
            rate(rows[kOutside],
                 [](const auto& o) { return o.report.verdict == "unexplained" || o.report.verdict == "class"; }),
            0.90, false);
  table.add("outside", "none_rate", rows[kOutside].size(),
            rate(rows[kOutside], [](const auto& o) { return o.report.verdict == "none"; }), 0.0, true);
  const auto inside = [&](double widths) {
    if (sizes.ratio.empty()) return std::nan("");
    return static_cast<double>(
               std::count_if(sizes.ratio.begin(), sizes.ratio.end(), [&](double r) { return r <= widths; })) /
           static_cast<double>(sizes.ratio.size());
  };
  const auto n = sizes.error.size();
  table.add("parameters", "coverage95", n, inside(1.0), 0.90, false, 0.99);
  table.add("parameters", "error_median", n, quantile(sizes.error, kMedian), 0.04, true);
  table.add("parameters", "error_p90", n, quantile(sizes.error, kNinth), 0.15, true);
  table.add("parameters", "sign_rate", n,
            n > 0 ? static_cast<double>(sizes.right_sign) / static_cast<double>(n) : std::nan(""), 1.0, false);
  table.add("gain", "hand_improvement_median", gain.size(), quantile(gain, kMedian), 3.0, false);
  add_curve(context, rows[kSingle]);
  // Reliability of the intervals: what share of the truths lies within so much of their width.
  context.table += fmt::format("\n{:<44} {:>6}\n", "interval narrowed or widened by", "holds");
  for (const double widths : {0.34, 0.65, 1.0, 1.5, 2.0}) {
    context.table += fmt::format("{:<44} {:>6.2f}\n", widths, inside(widths));
    context.summary["reliability"].push_back({{"widths", widths}, {"holds", inside(widths)}});
  }
}

}  // namespace bodyschema
