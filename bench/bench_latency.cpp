// From pictures published on LCM to offsets received, through the real daemon, fed from a recorded
// log at 30 Hz. One iteration is one frame; its time is its latency. See README.md.

#include <benchmark/benchmark.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "bodyschema/bus/bus_options.hpp"
#include "integration/harness.hpp"

namespace {

using namespace bodyschema;
using namespace bodyschema::integration;
using Clock = std::chrono::steady_clock;

/// Asks the daemon's status every second, and its offsets as they come; remembers when.
class Arrivals {
 public:
  explicit Arrivals(const std::string& url) : link_(url) {
    const Channels channels = Channels::with_prefix("ICUB");
    link_.subscribe(channels.joint_offsets, 1000, [this](const std::string&, Bytes message, std::int64_t) {
      const auto now = Clock::now();
      joint_offsets_t offsets;
      if (!decode(message, offsets).ok()) return;
      const std::lock_guard lock(mutex_);
      received_.emplace(offsets.utime, now);
    });
    link_.subscribe(channels.offsets_status, 100, [this](const std::string&, Bytes message, std::int64_t) {
      offsets_status_t status;
      if (!decode(message, status).ok()) return;
      const std::lock_guard lock(mutex_);
      status_ = std::move(status);
    });
    thread_ = std::jthread([this](const std::stop_token& stop) {
      while (!stop.stop_requested()) link_.handle(20);
    });
  }
  void published(Microseconds utime) {
    const std::lock_guard lock(mutex_);
    published_.emplace_back(utime, Clock::now());
  }
  /// Latencies in ms of the frames published so far; those without an answer are left out.
  std::vector<double> latencies_ms() {
    const std::lock_guard lock(mutex_);
    std::vector<double> result;
    for (const auto& [utime, sent] : published_) {
      const auto found = received_.find(utime);
      if (found == received_.end()) continue;
      result.push_back(std::chrono::duration<double, std::milli>(found->second - sent).count());
    }
    return result;
  }
  std::size_t frames_published() {
    const std::lock_guard lock(mutex_);
    return published_.size();
  }
  offsets_status_t status() {
    const std::lock_guard lock(mutex_);
    return status_;
  }
  void forget() {
    const std::lock_guard lock(mutex_);
    published_.clear();
    received_.clear();
  }

 private:
  LcmLink link_;
  std::mutex mutex_;
  std::vector<std::pair<Microseconds, Clock::time_point>> published_;
  std::map<Microseconds, Clock::time_point> received_;
  offsets_status_t status_{};
  std::jthread thread_;
};

/// Processor time a process has used so far, all its threads, s.
double processor_s(pid_t pid) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/stat");
  std::string field;
  std::getline(file, field, ')');  // the name may hold blanks
  for (int i = 3; i < 14; ++i) file >> field;
  double user = 0.0;
  double system = 0.0;
  file >> user >> system;
  return (user + system) / static_cast<double>(sysconf(_SC_CLK_TCK));
}

double quantile(std::vector<double> sorted, double share) {
  return sorted[static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1))];
}

/// Who is played.
struct Played {
  std::string triangles;
  std::filesystem::path folder;  ///< of its configuration, in the source tree
  double focal_px;               ///< of a picture 320 px wide
  [[nodiscard]] std::string file(const char* name) const {
    return (std::filesystem::path(BODYSCHEMA_SOURCE_DIR) / folder / name).string();
  }
};

const Played kOurs{"8k", "config/icub_right", 257.34};
const Played kG1{"200k", "bench/g1", 302.5};

struct Size {
  int width, height;
  [[nodiscard]] std::string text() const { return std::to_string(width) + "x" + std::to_string(height); }
  /// The robot's cameras with pictures of this size, as arguments.
  [[nodiscard]] std::vector<std::string> arguments(const Played& robot) const {
    std::vector<std::string> list;
    const double focal_px = robot.focal_px * width / 320.0;
    for (const std::string camera : {"cameras.left.", "cameras.right."}) {
      for (const std::string& set :
           {"width=" + std::to_string(width), "height=" + std::to_string(height), "fx=" + std::to_string(focal_px),
            "fy=" + std::to_string(focal_px), "cx=" + std::to_string(0.5 * (width - 1)),
            "cy=" + std::to_string(0.5 * (height - 1))}) {
        list.insert(list.end(), {"--set", camera + set});
      }
    }
    return list;
  }
};

/// The tests' reach in other pictures: compressed, by the sender beforehand.
std::filesystem::path log_of(const Played& robot, Size size, const std::filesystem::path& folder) {
  const auto file = folder / "reach.lcmlog";
  std::vector<std::string> command{"bodyschema-sim",
                                   "--config",
                                   robot.file("simulator.yaml"),
                                   "--frames",
                                   "60",
                                   "--seed",
                                   "7",
                                   "--pictures",
                                   "jpeg",
                                   "--log",
                                   file.string()};
  for (const auto& argument : size.arguments(robot)) command.push_back(argument);
  Process simulator(command, folder);
  if (simulator.wait(Seconds(300)) != 0) throw std::runtime_error("bodyschema-sim failed: " + simulator.err());
  return file;
}

void latency(benchmark::State& state, const std::string& engine, const Played& robot, int seconds, Size size,
             bool jpeg) {
  const Scratch scratch;
  const std::string url = own_lcm_url();
  const auto log = jpeg ? log_of(robot, size, scratch.folder()) : reach_log();
  std::vector<std::string> command{"bodyschemad", "--config", robot.file("estimator.yaml"), "--engine", engine,
                                   "--lcm-url",   url};
  for (const auto& argument : size.arguments(robot)) command.push_back(argument);
  Process daemon(command, scratch.folder());
  if (!daemon.said("waiting for", Seconds(60))) {
    state.SkipWithError("bodyschemad did not start");
    return;
  }
  Arrivals arrivals(url);
  std::vector<double> all;
  offsets_status_t status;
  std::size_t published = 0;
  double cores = 0.0;
  double memory_before = 0.0;
  {
    Robot player(url, log);
    Robot::Faults watch;
    watch.pictures = [&](bot_core::images_t& pictures, LcmLink&) {
      arrivals.published(pictures.images.front().utime);
      return true;
    };
    std::this_thread::sleep_for(std::chrono::seconds(5));  // background learned, caches warm
    memory_before = static_cast<double>(arrivals.status().resident_bytes);
    const auto start = Clock::now();
    const double used_s = processor_s(daemon.pid());
    player.set_faults(watch);
    std::this_thread::sleep_for(std::chrono::seconds(seconds));
    cores = (processor_s(daemon.pid()) - used_s) / std::chrono::duration<double>(Clock::now() - start).count();
    player.set_faults({});
    std::this_thread::sleep_for(std::chrono::milliseconds(1500));
    all = arrivals.latencies_ms();
    published = arrivals.frames_published();
    status = arrivals.status();
  }
  if (all.empty()) {
    state.SkipWithError("no offsets came back");
    return;
  }
  std::size_t next = 0;
  for (auto _ : state) state.SetIterationTime(1e-3 * all[next++ % all.size()]);
  std::sort(all.begin(), all.end());
  state.counters["frames"] = static_cast<double>(published);
  state.counters["unanswered"] = static_cast<double>(published - all.size());
  state.counters["shed"] = static_cast<double>(status.frames_dropped);
  state.counters["median_ms"] = quantile(all, 0.5);
  state.counters["p99_ms"] = quantile(all, 0.99);
  state.counters["max_ms"] = all.back();
  for (std::size_t i = 0; i < status.stage_name.size(); ++i) {
    state.counters[status.stage_name[i] + "_median_ms"] = status.stage_median_ms[i];
    state.counters[status.stage_name[i] + "_p99_ms"] = status.stage_p99_ms[i];
  }
  state.counters["daemon_cores"] = cores;
  state.counters["memory_before_MiB"] = memory_before / (1 << 20);
  state.counters["memory_MiB"] = static_cast<double>(status.resident_bytes) / (1 << 20);
}

}  // namespace

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  try {
    if (const std::string why = why_no_lcm(); !why.empty()) throw std::runtime_error(why);
    const char* wish = std::getenv("BODYSCHEMA_BENCH_SECONDS");
    const int seconds = wish != nullptr ? std::max(2, std::atoi(wish)) : 60;
    const auto add = [&](const Played& robot, Size size, bool jpeg) {
      for (const std::string engine : {"contour", "atlas"}) {
        benchmark::RegisterBenchmark(
            ("daemon" + std::string(jpeg ? "+jpeg/" : "/") + engine + "/" + robot.triangles + "/" + size.text() +
             "/200")
                .c_str(),
            [=, &robot](benchmark::State& state) { latency(state, engine, robot, seconds, size, jpeg); })
            ->UseManualTime()
            ->Iterations(1000)
            ->Unit(benchmark::kMillisecond);
      }
    };
    const char* data = std::getenv("BODYSCHEMA_DATA");
    const bool g1 = data != nullptr && std::filesystem::exists(std::filesystem::path(data) / "real/robots/g1");
    for (const Size size : {Size{320, 240}, Size{640, 480}, Size{1280, 720}}) {
      if (size.width == 320) add(kOurs, size, false);  // raw pictures that are larger do not fit most networks
      add(kOurs, size, true);
      if (g1) add(kG1, size, true);
    }
    benchmark::RunSpecifiedBenchmarks();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_latency: %s\n", error.what());
    return 1;
  }
  benchmark::Shutdown();
}
