#include <spdlog/fmt/fmt.h>
#include <unistd.h>

#include <atomic>
#include <cmath>
#include <fstream>
#include <thread>

#include "bodyschema/bus/log.hpp"
#include "bodyschema/core/error.hpp"
#include "bodyschema/core/progress_bar.hpp"
#include "bodyschema/core/write_file.hpp"
#include "bodyschema/diagnosis/log_diagnosis.hpp"
#include "bodyschema/diagnosis_trials/trials.hpp"
#include "bodyschema/simulator/recording.hpp"
#include "experiments.hpp"

/// How often the diagnosis is right, on logs with hidden faults: large counts at the level of
/// silhouettes (points of the outline with noise, no pictures), some through rendered pictures.
namespace bodyschema {
namespace {

namespace fs = std::filesystem;

constexpr double kPictureLog_s = 60.0;
constexpr double kPictureRate_hz = 10.0;
/// Of 40 logs through pictures for 200 single-cause trials.
constexpr TrialCounts kPictureLogs = {8, 3, 12, 4, 6, 4, 3};
constexpr double kTrialsOfThose = 200.0;

/// A fault of the trials in the simulator's words.
simulator::FaultSpec spec_of(const TrialFault& fault) {
  auto spec = simulator::FaultSpec::of(fault.cause.name, fault.cause.joint, fault.value);
  const auto& name = fault.cause.name;
  if (!fault.cause.source.empty()) spec.arguments["source"] = fault.cause.source;
  if (name == "slip") spec.set("at", fault.second * kPictureLog_s);
  if (name == "wobble") spec.set("period", fault.second);
  if (fault.value != 0.0) return spec;
  // The second of two parameters.
  if (name == "axis_tilt") spec.arguments["about"] = "2";
  if (name == "principal_point") spec.arguments["axis"] = "y";
  return spec.set("value", fault.second);
}

/// A log written by the simulator, diagnosed by what `bodyschema diagnose` runs; deleted at the end.
class PictureLog final : public TrialLog {
 public:
  PictureLog(const TrialRobot& robot, const simulator::SimulatorSettings& settings, fs::path configuration,
             const TrialOptions& options, std::uint64_t seed)
      : configuration_(std::move(configuration)) {
    static std::atomic<int> number{0};
    file_ = fs::temp_directory_path() / fmt::format("bodyschema_{}_diagnosis_{}.log", getpid(), number++);
    simulator::SimulationPlan plan;
    plan.seed = seed;
    plan.motion = simulator::Motion::kBabble;
    plan.seconds = kPictureLog_s;
    for (std::size_t j = 0; j < robot.setup.estimated_joints.size(); ++j) {
      const double turn = static_cast<double>((seed >> (8 * j)) & 255u) / 255.0;
      plan.offsets_deg[robot.setup.estimated_joints[j]] = -7.0 + 14.0 * turn;
    }
    for (const auto& fault : options.faults) plan.faults.push_back(spec_of(fault));
    simulator::Simulator simulator(robot.model, robot.setup, robot.rig, settings, plan);
    LogWriter log(file_);
    simulator::FramePublisher publisher(simulator.joint_names(), {});
    while (const auto frame = simulator.next()) publisher.publish(*frame, log);
  }
  ~PictureLog() override {
    std::error_code error;
    fs::remove(file_, error);
  }
  DiagnosisReport diagnose(const std::optional<std::vector<CauseName>>& fixed_causes) override {
    LogDiagnosisOptions options;
    options.log = file_;
    options.picture_rate_hz = kPictureRate_hz;
    options.threads = 1;  // other logs run beside this one
    options.quiet = true;
    options.diagnosis.fixed_causes = fixed_causes;
    return diagnose_log(Configuration::load(configuration_), options);
  }

 private:
  fs::path configuration_, file_;
};

TrialLogMaker picture_logs(const ExperimentContext& context, const TrialRobot& robot) {
  auto settings = simulator::SimulatorSettings::from(context.simulated.section("simulator"));
  settings.camera_rate_hz = kPictureRate_hz;
  const auto configuration = context.recorded / "icub_right" / "estimator.yaml";
  return [&robot, settings, configuration](const TrialOptions& options, std::uint64_t seed) {
    return std::make_unique<PictureLog>(robot, settings, configuration, options, seed);
  };
}

/// One figure of the table with what is demanded of it.
struct Figure {
  const char* row;
  const char* name;  ///< as in summary.json
  double value;
  bool at_most;  ///< else at least
  double demand;
  double upper = 1e9;   ///< coverage has both bounds
  bool is_rate = true;  ///< may be five points worse through pictures
};

std::vector<Figure> figures(const TrialRates& r) {
  return {{"null", "false_alarm_rate", r.null_false_alarm, true, 0.02},
          {"background", "named_rate", r.background_named, true, 0.05},
          {"single", "in_class_rate", r.single_in_class, false, 0.95},
          {"single", "exact_rate", r.single_exact, false, 0.85},
          {"single", "wrong_rate", r.single_wrong, true, 0.02},
          {"single", "mean_class_size", r.single_mean_class, true, 1.5, 1e9, false},
          {"limit", "wrong_rate", r.limit_wrong, true, 0.05},
          {"two", "both_rate", r.two_both, false, 0.85},
          {"two", "spurious_rate", r.two_spurious, true, 0.05},
          {"outside", "unexplained_rate", r.outside_unexplained, false, 0.85},
          {"outside_hard", "joint_rate", r.outside_hard_joint, false, 0.70},
          {"outside_hard", "class_or_unexplained_rate", r.outside_hard_class_or_unexplained, false, 0.50},
          {"parameters", "sign_rate", r.sign, false, 1.0},
          {"parameters", "error_median", r.error_median, true, 0.05, 1e9, false},
          {"parameters", "error_p90", r.error_p90, true, 0.15, 1e9, false},
          {"parameters", "coverage95", r.coverage95, false, 0.90, 0.98},
          {"gain", "removable_excess_median", r.removable_excess_median, false, 0.80},
          {"gain", "offset_improvement_median", r.offset_improvement_median, false, 3.0, 1e9, false}};
}

std::string demand_text(const Figure& f, double slack) {
  const double share = f.is_rate ? slack : 0.0;
  if (f.upper < 1e8) return fmt::format("{:.2f} to {:.2f}", f.demand - share, f.upper + share);
  return fmt::format("{} {:.2f}", f.at_most ? "at most" : "at least", f.at_most ? f.demand + share : f.demand - share);
}

bool reached(const Figure& f, double slack) {
  const double share = f.is_rate ? slack : 0.0;
  constexpr double kRounding = 1e-9;
  if (f.at_most) return f.value <= f.demand + share + kRounding;
  return f.value >= f.demand - share - kRounding && f.value <= f.upper + share + kRounding;
}

std::size_t trials_of(const Figure& f, const TrialRates& r) {
  for (std::size_t s = 0; s < kTrialRows; ++s) {
    if (std::string(kTrialRowNames[s]) == f.row) return r.trials[s];
  }
  return std::string(f.row) == "parameters" ? r.parameters : r.gains;
}

void add_table(ExperimentContext& context, const std::string& title, const TrialRates& r, Json& summary, double slack) {
  context.table += fmt::format("\n{:<44} {:>6} {:>9}   {}\n", title, "trials", "measured", "demand");
  for (std::size_t s = 0; s < kTrialRows; ++s) {
    summary[kTrialRowNames[s]]["trials"] = r.trials[s];
    summary[kTrialRowNames[s]]["refused"] = r.refused[s];
    if (r.refused[s] > 0) context.table += fmt::format("{}: {} logs refused\n", kTrialRowNames[s], r.refused[s]);
  }
  for (const auto& f : figures(r)) {
    const bool known = std::isfinite(f.value);
    summary[f.row][f.name] = known ? Json(f.value) : Json(nullptr);
    if (!known) continue;
    context.table += fmt::format("{:<44} {:>6} {:>9.3f}   {:<14} {}\n", fmt::format("{} {}", f.row, f.name),
                                 trials_of(f, r), f.value, demand_text(f, slack), reached(f, slack) ? "" : "missed");
  }
}

Json json_of(const TrialOutcome& o) {
  Json truth = Json::array(), answer = Json::array();
  for (const auto& f : o.truth) {
    truth.push_back(
        {{"cause", f.cause.text()}, {"value", f.value}, {"second", f.second}, {"detectable", f.detectable}});
  }
  for (const auto& c : o.report.causes) {
    Json same = Json::array();
    for (const auto& s : c.same) same.push_back(s.text());
    Json parameters = Json::array();
    for (const auto& p : c.parameters) {
      parameters.push_back({{"parameter", p.parameter}, {"estimate", p.estimate}, {"ci95", {p.ci95[0], p.ci95[1]}}});
    }
    answer.push_back({{"cause", c.cause.text()},
                      {"variable", c.variable},
                      {"class", same},
                      {"z", c.z},
                      {"heldout_gain", c.heldout_gain},
                      {"parameters", parameters}});
  }
  return {{"row", kTrialRowNames[static_cast<std::size_t>(o.row)]},
          {"seed", o.seed},
          {"truth", truth},
          {"answer", answer},
          {"sentence", o.report.sentence},
          {"crowded", o.report.crowded},
          {"rms_px", {o.report.before.rms_px, o.report.after.rms_px}},
          {"seconds", o.seconds}};
}

TrialRates run_rows(ExperimentContext& context, const std::string& label, const TrialRobot& robot,
                    const TrialCounts& counts, const TrialLogMaker& maker, std::ofstream& trials) {
  int total = 0;
  for (const int n : counts) total += n;
  ProgressBar bar(label, static_cast<std::uint64_t>(total));
  int threads = context.options.threads;
  if (threads <= 0) threads = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  const auto outcomes = run_diagnosis_trials(robot, counts, context.options.seed, threads, maker,
                                             [&](const TrialOutcome& outcome, std::size_t done, std::size_t) {
                                               trials << json_of(outcome).dump() << '\n';
                                               bar.set(done);
                                             });
  return rates(outcomes);
}

}  // namespace

void run_diagnosis(ExperimentContext& context) {
  TrialRobot robot;
  robot.setup = RobotSetup::from(context.simulated.section("robot"));
  robot.rig = StereoRig::from(context.simulated.section("cameras"));
  robot.model = load_robot(robot.setup, robot.rig);
  const auto file = context.options.out / "trials.jsonl";
  std::ofstream trials = open_to_write(file);

  const auto silhouettes = run_rows(context, "silhouette-level logs", robot, trial_counts(context.options.trials),
                                    silhouette_logs(robot), trials);
  add_table(context, "at the level of silhouettes", silhouettes, context.summary, 0.0);
  TrialCounts counts{};
  for (std::size_t s = 0; s < counts.size(); ++s) {
    counts[s] = std::max(1, static_cast<int>(std::lround(kPictureLogs[s] * context.options.trials / kTrialsOfThose)));
  }
  const auto pictures = run_rows(context, "logs through pictures", robot, counts, picture_logs(context, robot), trials);
  add_table(context, "through full pictures, 60 s at 10 Hz", pictures, context.summary["images"], 0.05);
  if (!trials.flush()) throw DeviceError(file.string() + ": cut short, is the disk full?");
}

}  // namespace bodyschema
