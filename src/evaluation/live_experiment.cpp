#include <fcntl.h>
#include <signal.h>
#include <spdlog/fmt/fmt.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstring>
#include <fstream>
#include <optional>

#include "bodyschema/bus/bus_options.hpp"
#include "bodyschema/bus/lcm_link.hpp"
#include "bodyschema/core/error.hpp"
#include "bodyschema/core/progress_bar.hpp"
#include "bodyschema/core/write_file.hpp"
#include "bodyschema/diagnosis/diagnosis_report.hpp"
#include "bodyschema/simulator/random.hpp"
#include "bodyschema/simulator/simulator.hpp"
#include "experiments.hpp"

extern char** environ;

/// How often the running service names what is wrong beside the offsets: simulator and service as processes of their
/// own, over LCM, in real time. Half of the robots are healthy, but for their joints' offsets.
namespace bodyschema {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr double kRun_s = 60.0, kCameraRate_hz = 10.0;
/// Sizes that a user cares about, times the smallest that a log shows at all.
constexpr double kLowest = 6.0, kHighest = 12.0;
constexpr std::array<const char*, 7> kFaults = {"latency",     "slip",        "backlash",      "encoder_gain",
                                                "link_length", "head_offset", "finger_posture"};

constexpr const char *kService = "bodyschemad", *kRobot = "bodyschema-sim";

/// A program that stands beside this one, its words in a file; ended with this.
class Program {
 public:
  Program(std::vector<std::string> arguments, fs::path words) : words_(std::move(words)) {
    arguments.front() = (programs_folder() / arguments.front()).string();
    std::vector<char*> argv;
    for (auto& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, words_.c_str(), O_CREAT | O_WRONLY | O_TRUNC, 0644);
    posix_spawn_file_actions_adddup2(&actions, STDOUT_FILENO, STDERR_FILENO);
    const int failed = posix_spawn(&pid_, argv[0], &actions, nullptr, argv.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    if (failed != 0) throw FileError(arguments.front() + ": cannot be started: " + std::strerror(failed));
  }
  ~Program() {
    if (!running()) return;
    kill(pid_, SIGTERM);
    waitpid(pid_, nullptr, 0);
  }
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  bool running() {
    if (status_) return false;
    int status = 0;
    if (waitpid(pid_, &status, WNOHANG) != pid_) return true;
    status_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128;
    return false;
  }
  [[nodiscard]] std::string words() const {
    std::ifstream file(words_);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  /// Throws DataError with its words where it did not end well.
  void check(const char* name) const {
    if (status_ == 0) return;
    throw DataError(fmt::format("{} ended with status {}: {}", name, status_.value_or(-1), words()));
  }

 private:
  fs::path words_;
  pid_t pid_ = -1;
  std::optional<int> status_;
};

/// What one run of the service said.
struct Run {
  std::uint64_t seed = 0;
  std::optional<simulator::FaultSpec> fault;
  std::optional<findings_t> first, last;  ///< messages: the first that named something, the last of all
  double first_s = 0.0;                   ///< from the first message on
  std::string sentence;                   ///< of the last status
  std::int64_t estimated = 0, dropped = 0;
  double processor_ms = 0.0, diagnosis_ms = 0.0;
};

/// @param joints  of the arm, from the root outwards
bool names(const simulator::FaultSpec& fault, const finding_t& finding, const std::vector<std::string>& joints) {
  const auto at = fault.arguments.find("joint");
  std::vector<std::string> places = {at == fault.arguments.end() ? std::string() : at->second};
  // The simulator names a link by the joint that turns it about its long axis, the catalogue by the one at its far end.
  const auto turns = std::find(joints.begin(), joints.end(), places.front());
  if (fault.name == "link_length" && turns != joints.end() && turns + 1 != joints.end()) places.push_back(turns[1]);
  return std::any_of(places.begin(), places.end(), [&](const std::string& joint) {
    const CauseName truth{fault.name, joint, ""};
    return CauseName{finding.effect, finding.joint, finding.source} == truth ||
           std::find(finding.alike.begin(), finding.alike.end(), truth.text()) != finding.alike.end();
  });
}

class Runs {
 public:
  explicit Runs(ExperimentContext& context) : context_(context), folder_(context.options.out / "live") {
    make_folder(folder_);
  }

  std::vector<Run> run(int count) {
    std::vector<Run> runs;
    ProgressBar bar("runs of the service", static_cast<std::uint64_t>(count));
    for (int i = 0; i < count; ++i) {
      Run run;
      run.seed = context_.options.seed + static_cast<std::uint64_t>(i);
      if (i % 2 == 1) run.fault = draw(run.seed, kFaults[static_cast<std::size_t>(i / 2) % kFaults.size()]);
      watch(run);
      runs.push_back(std::move(run));
      bar.set(static_cast<std::uint64_t>(i) + 1);
    }
    return runs;
  }

 private:
  simulator::FaultSpec draw(std::uint64_t seed, const std::string& kind) const {
    const auto setup = RobotSetup::from(context_.simulated.section("robot"));
    const auto rig = StereoRig::from(context_.simulated.section("cameras"));
    simulator::FaultSite site(load_robot(setup, rig), setup, rig);
    site.begin_s = 0.0;
    site.end_s = kRun_s;
    simulator::DrawOptions options;
    for (const auto& other : simulator::fault_kinds()) {
      if (other.name != kind) options.exclude.push_back(other.name);
    }
    simulator::Random random(seed, "size of the fault");
    options.multiple_of_detectable = kLowest * std::pow(kHighest / kLowest, random.uniform(0.0, 1.0));
    return simulator::draw_fault(seed, site, options);
  }

  void watch(Run& run) {
    // A port of this run's own, so that robots and other runs on this machine are not disturbed.
    const std::string url = fmt::format("udpm://239.255.76.67:{}?ttl=0",
                                        20'000 + (static_cast<std::uint64_t>(getpid()) + run.seed) % 12'000);
    LcmLink link(url);
    const auto channels = BusOptions::from(context_.simulated.section("bus")).channels();
    const auto begin = Clock::now();
    link.subscribe(channels.findings, 100, [&](const std::string&, Bytes message, std::int64_t) {
      findings_t found;
      if (!decode(message, found).ok()) return;
      if (!run.first && found.num_findings > 0) {
        run.first = found;
        run.first_s = std::chrono::duration<double>(Clock::now() - begin).count();
      }
      run.last = std::move(found);
    });
    link.subscribe(channels.offsets_status, 100, [&](const std::string&, Bytes message, std::int64_t) {
      offsets_status_t status;
      if (!decode(message, status).ok() || status.frames_estimated == 0) return;
      run.estimated = status.frames_estimated;
      run.dropped = status.frames_dropped;
      if (status.level != offsets_status_t::STALE) run.sentence = status.sentence;
      for (std::size_t i = 0; i < status.counter_name.size(); ++i) {
        const auto value = static_cast<double>(status.counter_value[i]);
        if (status.counter_name[i] == "processor_ms") run.processor_ms = value;
        if (status.counter_name[i] == "processor_ms.diagnosis") run.diagnosis_ms = value;
      }
    });
    const auto configurations = context_.recorded / "icub_right";
    std::vector<std::string> arguments = {
        kService, "--config", (configurations / "estimator.yaml").string(), "--lcm-url", url, "--stop-after-idle", "3"};
    for (const auto& choice : context_.options.overrides) arguments.insert(arguments.end(), {"--set", choice});
    Program service(std::move(arguments), folder_ / fmt::format("service_{}.txt", run.seed));
    const auto until = [&](auto condition, double limit_s) {
      const auto end = Clock::now() + std::chrono::duration<double>(limit_s);
      while (!condition() && Clock::now() < end) link.handle(100);
      return condition();
    };
    constexpr double kStart_s = 60.0, kEnd_s = 120.0;
    if (!until([&] { return service.words().find("waiting for") != std::string::npos || !service.running(); },
               kStart_s))
      throw DataError(std::string(kService) + " did not start: " + service.words());
    arguments = {kRobot,
                 "--config",
                 (configurations / "simulator.yaml").string(),
                 "--lcm-url",
                 url,
                 "--babble",
                 fmt::format("{}", kRun_s),
                 "--offsets",
                 "random",
                 "--seed",
                 std::to_string(run.seed),
                 "--set",
                 fmt::format("simulator.cameras.rate_hz={}", kCameraRate_hz)};
    if (run.fault) arguments.insert(arguments.end(), {"--fault", run.fault->text()});
    Program robot(std::move(arguments), folder_ / fmt::format("robot_{}.txt", run.seed));
    until([&] { return !service.running(); }, kRun_s + kEnd_s);
    if (!robot.running()) robot.check(kRobot);
    if (!service.running()) service.check(kService);
  }

  ExperimentContext& context_;
  fs::path folder_;
};

Json json_of(const Run& run) {
  Json json = {{"seed", run.seed}, {"fault", run.fault ? Json(run.fault->text()) : Json(nullptr)}};
  const auto list = [](const std::optional<findings_t>& message) {
    Json said = Json::array();
    for (std::size_t i = 0; message && i < message->finding.size(); ++i) {
      const auto& f = message->finding[i];
      said.push_back({{"sentence", f.sentence}, {"z", f.z}, {"estimated", f.estimated != 0}, {"alike", f.alike}});
    }
    return said;
  };
  json["first"] = list(run.first);
  json["first_after_s"] = run.first_s;
  json["last"] = list(run.last);
  json["blocks"] = run.last ? run.last->blocks : 0;
  json["sentence"] = run.sentence;
  json["estimated"] = run.estimated;
  json["dropped"] = run.dropped;
  json["processor_ms"] = run.processor_ms;
  json["diagnosis_ms"] = run.diagnosis_ms;
  return json;
}

}  // namespace

fs::path programs_folder() {
  return fs::read_symlink("/proc/self/exe").parent_path();
}

void check_live_programs(const fs::path& folder) {
  for (const char* name : {kService, kRobot}) {
    if (!fs::exists(folder / name)) {
      throw FileError((folder / name).string() + ": no such program, and the experiment 'live' starts it");
    }
  }
}

void run_live(ExperimentContext& context) {
  const int asked = context.options.trials;
  const int count = std::max(2, context.options.experiment == "all" ? std::min(asked, kMostLiveRuns) : asked);
  const auto runs = Runs(context).run(count);
  const auto joints = RobotSetup::from(context.simulated.section("robot")).estimated_joints;
  double healthy = 0.0, alarms = 0.0, faulty = 0.0, right = 0.0, processor = 0.0, diagnosis = 0.0;
  std::int64_t dropped = 0;
  std::string lines;
  for (const auto& run : runs) {
    lines += json_of(run).dump() + '\n';
    processor += run.processor_ms;
    diagnosis += run.diagnosis_ms;
    dropped += run.dropped;
    if (!run.fault) {
      healthy += 1.0;
      alarms += run.first ? 1.0 : 0.0;
      continue;
    }
    faulty += 1.0;
    right += run.last && !run.last->finding.empty() && names(*run.fault, run.last->finding.front(), joints) ? 1.0 : 0.0;
  }
  replace_file(context.options.out / "live_runs.jsonl", lines);
  context.table +=
      fmt::format("\n{:<44} {:>6} {:>9}   {}\n", "through the service, 60 s at 10 Hz", "runs", "measured", "demand");
  const auto add = [&](const char* name, double n, double value, double demand, bool at_most) {
    context.summary["live"][name] = value;
    const bool met = at_most ? value <= demand : value >= demand;
    context.table += fmt::format("{:<44} {:>6} {:>9.3f}   {} {:<8.2f} {}\n", fmt::format("live {}", name), n, value,
                                 at_most ? "at most" : "at least", demand, met ? "" : "missed");
  };
  add("in_class_rate", faulty, right / std::max(1.0, faulty), 0.85, false);
  add("false_alarm_rate", healthy, alarms / std::max(1.0, healthy), 0.05, true);
  add("cost_share", healthy + faulty, diagnosis / std::max(1.0, processor), 0.05, true);
  add("dropped_frames", healthy + faulty, static_cast<double>(dropped), 0.0, true);
  context.summary["live"]["trials"] = runs.size();
}

}  // namespace bodyschema
