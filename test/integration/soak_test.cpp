#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>

#include "bodyschema/geometry/pose.hpp"
#include "harness.hpp"
#include "world_faults.hpp"

/// The real daemon at 30 Hz for as long as one likes, faults of the world at random: no crash, memory
/// flat, no drift of what a frame costs, every picture accounted for. scripts/soak runs it; ctest only
/// with -C soak.
///   BODYSCHEMA_SOAK_S (s on the clock), BODYSCHEMA_SEED, BODYSCHEMA_SOAK_RATE_HZ (30 pictures a second on the
///   clock), BODYSCHEMA_SOAK_CAMERA_HZ (30 pictures a second of the robot's time, 30 / n): 5 Hz played at 30 Hz are
///   six times as many simulated seconds
namespace bodyschema::integration {
namespace {

using Clock = std::chrono::steady_clock;

double number_of(const char* variable, double otherwise) {
  const char* text = std::getenv(variable);
  return text != nullptr && *text != '\0' ? std::atof(text) : otherwise;
}

std::map<std::string, double> true_offsets() {
  std::map<std::string, double> offsets;
  const auto json = nlohmann::json::parse(std::ifstream(reach_truth()));
  for (const auto& [name, value] : json.at("offsets_deg").items()) offsets[name] = radians(value.get<double>());
  return offsets;
}

/// Processor time a process has used, s.
double processor_s(pid_t pid) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/stat");
  std::string text((std::istreambuf_iterator<char>(file)), {});
  std::istringstream fields(text.substr(std::min(text.size(), text.rfind(')') + 1)));
  std::string field;
  double ticks = 0.0;
  for (int i = 3; fields >> field && i <= 15; ++i) {
    if (i >= 14) ticks += std::atof(field.c_str());
  }
  return ticks / static_cast<double>(sysconf(_SC_CLK_TCK));
}

double load_average() {
  double load = 0.0;
  std::ifstream("/proc/loadavg") >> load;
  return load;
}

double median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

/// What was measured over one minute of the run.
struct Minute {
  double rss_MiB = 0.0;
  double latency_ms = 0.0;  ///< median of the seconds' medians
  double cost_ms = 0.0;     ///< processor time of the daemon per estimate
  double estimates = 0.0;
  double load = 0.0;
};

/// Every estimate that calls itself converged: near the truth, or counted.
class Honesty {
 public:
  explicit Honesty(std::shared_ptr<const faults::Stall> stall) : stall_(std::move(stall)) {}
  void check(const joint_offsets_t& message, const std::string& during) {
    ++published_;
    if (message.state != "converged") return;
    ++converged_;
    for (std::size_t k = 0; k < message.mean_rad.size(); ++k) {
      const auto it = truth_.find(message.joint_name[k]);
      double offset = it == truth_.end() ? 0.0 : it->second;
      if (message.joint_name[k] == faults::kStalls) offset += stall_->at(message.utime);
      const double error = std::abs(message.mean_rad[k] - offset);
      const double sd = std::sqrt(message.covariance_rad2[k][k]);
      if (error <= std::max(5.0 * sd, radians(1.0))) continue;
      std::printf("not honest at %lld, %s: %s off by %.2f deg, says %.2f\n", static_cast<long long>(message.utime),
                  during.c_str(), message.joint_name[k].c_str(), degrees(error), degrees(sd));
      ++dishonest_[during];
      worst_deg_ = std::max(worst_deg_, degrees(error));
      break;
    }
  }
  std::int64_t published_ = 0, converged_ = 0;
  std::map<std::string, int> dishonest_;
  double worst_deg_ = 0.0;

 private:
  const std::shared_ptr<const faults::Stall> stall_;
  const std::map<std::string, double> truth_ = true_offsets();
};

TEST(Soak, DaemonLivesThroughFaultsAtRandom) {
  if (const std::string reason = why_no_lcm(); !reason.empty()) GTEST_SKIP() << reason;
  const double length_s = number_of("BODYSCHEMA_SOAK_S", 120.0);
  const double rate_hz = number_of("BODYSCHEMA_SOAK_RATE_HZ", 30.0);
  const auto seed = static_cast<unsigned>(number_of("BODYSCHEMA_SEED", std::random_device{}()));
  const auto every = static_cast<std::size_t>(std::lround(30.0 / number_of("BODYSCHEMA_SOAK_CAMERA_HZ", 30.0)));
  ASSERT_GE(every, 1u);
  const double speed = rate_hz * static_cast<double>(every) / 30.0;
  std::printf("%.0f s at %.0f Hz, %.0f simulated seconds, BODYSCHEMA_SEED=%u\n", length_s, rate_hz, speed * length_s,
              seed);
  std::mt19937 random(seed);
  const auto between = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };

  const std::string url = own_lcm_url();
  Scratch scratch;
  Process service({"bodyschemad", "--config", reach_configuration(), "-l", url}, scratch.folder());
  ASSERT_TRUE(service.said("waiting for", Seconds(120))) << service.err();
  // Memory grows over the first reloads, as every thread that loads or scores finds its arena; then no more.
  for (int i = 0; i < 8; ++i) {
    service.signal(SIGHUP);
    std::this_thread::sleep_for(std::chrono::seconds(3));
  }
  Listener listener(url);
  Robot robot(url, reach_log(), speed, every);

  const auto stall = std::make_shared<faults::Stall>();
  const std::vector<faults::Named> faults = faults::all(seed, stall);
  std::vector<int> suffered(faults.size() + 2);  // and: reloaded, held up
  Honesty honesty(stall);
  std::vector<Minute> minutes;
  std::vector<double> rss, latency;
  double cpu_s = processor_s(service.pid());
  std::int64_t estimated = 0;
  std::int64_t crashes = 0;
  std::string fault = "no fault";
  auto next_change = Clock::now() + std::chrono::seconds(15);
  const auto start = Clock::now();
  auto next_minute = start + std::chrono::seconds(60);
  std::size_t statuses_seen = 0;
  bool healthy = true;
  const auto take_in = [&] {
    for (const auto& message : listener.take_offsets()) honesty.check(message, fault);
    const auto statuses = listener.statuses();
    for (; statuses_seen < statuses.size(); ++statuses_seen) {
      rss.push_back(static_cast<double>(statuses[statuses_seen].resident_bytes) / (1 << 20));
      if (statuses[statuses_seen].latency_median_ms > 0.0) latency.push_back(statuses[statuses_seen].latency_median_ms);
    }
  };
  while (Seconds(Clock::now() - start).count() < length_s) {
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    if (!service.running()) {
      ++crashes;
      break;
    }
    take_in();
    if (Clock::now() >= next_change) {
      // What was published before the change was published under the old fault.
      if (healthy) {
        const std::size_t which = random() % suffered.size();
        ++suffered[which];
        if (which < faults.size()) {
          fault = faults[which].name;
          robot.set_faults(faults[which].make());
        } else if (which == faults.size()) {
          fault = "configuration reloaded";
          service.signal(SIGHUP);
        } else {
          fault = "held up for 3 s";
          service.signal(SIGSTOP);
          std::this_thread::sleep_for(std::chrono::seconds(3));
          service.signal(SIGCONT);
        }
      } else {
        fault = "after " + fault;
        robot.set_faults({});
      }
      healthy = !healthy;
      next_change =
          Clock::now() + std::chrono::duration_cast<Clock::duration>(Seconds(between(2.0, healthy ? 12.0 : 8.0)));
    }
    if (Clock::now() < next_minute) continue;
    next_minute += std::chrono::seconds(60);
    const double used_s = processor_s(service.pid()) - cpu_s;
    cpu_s += used_s;
    const auto now_estimated = listener.statuses().empty() ? 0 : listener.statuses().back().frames_estimated;
    const auto n = static_cast<double>(now_estimated - estimated);
    estimated = now_estimated;
    minutes.push_back({median(rss), median(latency), n > 0 ? 1e3 * used_s / n : 0.0, n, load_average()});
    rss.clear();
    latency.clear();
    const Minute& m = minutes.back();
    std::printf(
        "minute %3zu  resident %6.1f MiB  latency %6.1f ms  %5.1f ms of processor per estimate  %5.0f estimates"
        "  load %.1f\n",
        minutes.size(), m.rss_MiB, m.latency_ms, m.cost_ms, m.estimates, m.load);
    std::fflush(stdout);
  }
  ASSERT_EQ(crashes, 0) << "during: " << fault << "\n" << service.err();

  // The end: faults over, the robot falls silent, the last frames are worked off.
  robot.set_faults({});
  std::this_thread::sleep_for(std::chrono::seconds(5));
  robot.stop();
  std::this_thread::sleep_for(std::chrono::seconds(4));
  take_in();
  service.signal(SIGTERM);
  ASSERT_EQ(service.wait(Seconds(20)), 0);
  std::this_thread::sleep_for(std::chrono::milliseconds(500));  // its last status is on the way
  const offsets_status_t last = listener.statuses().back();

  std::printf("\nfaults suffered:\n");
  int total = 0;
  for (std::size_t i = 0; i < suffered.size(); ++i) {
    const std::string name = i < faults.size()    ? faults[i].name
                             : i == faults.size() ? "configuration reloaded"
                                                  : "held up for 3 s";
    std::printf("  %3d  %s\n", suffered[i], name.c_str());
    total += suffered[i];
  }
  const std::int64_t sent = robot.sent();
  const std::int64_t arrived = counter(last, "messages");
  const std::int64_t pictures = counter(last, "pictures.arrived");
  const std::int64_t used = counter(last, "pictures.used");
  const std::int64_t dropped = counters_with(last, "dropped.");
  const std::int64_t refused = counter(last, "pictures.refused");
  const std::int64_t mono = counter(last, "mono");
  const std::int64_t shed = counter(last, "shed.queue");
  const std::int64_t failed = counter(last, "failed");
  std::printf("%d faults; %lld messages sent, %lld arrived, %lld lost on the way\n", total,
              static_cast<long long>(sent), static_cast<long long>(arrived), static_cast<long long>(sent - arrived));
  std::printf("%lld pictures: %lld used, %lld dropped, %lld refused, %lld waiting at the end\n",
              static_cast<long long>(pictures), static_cast<long long>(used), static_cast<long long>(dropped),
              static_cast<long long>(refused), static_cast<long long>(pictures - used - dropped - refused));
  std::printf("%lld frames estimated, %lld shed, %lld with one camera\n", static_cast<long long>(last.frames_estimated),
              static_cast<long long>(shed), static_cast<long long>(mono));
  std::printf("%lld estimates published, %lld converged; not honest:", static_cast<long long>(honesty.published_),
              static_cast<long long>(honesty.converged_));
  int dishonest = 0;
  for (const auto& [during, count] : honesty.dishonest_) {
    std::printf(" %d (%s)", count, during.c_str());
    dishonest += count;
  }
  std::printf("%s, worst %.1f deg\n", dishonest == 0 ? " none" : "", honesty.worst_deg_);

  // Every picture is used, dropped for a reason, refused for a reason, or (few) still waiting; every
  // frame made of used ones was estimated, shed, or left at the end.
  const std::int64_t waiting = pictures - used - dropped - refused;
  EXPECT_GE(waiting, 0);
  EXPECT_LE(waiting, 6);
  EXPECT_EQ(pictures_unaccounted_for(last), 0);
  EXPECT_EQ(failed, 0) << "frames that could not be worked on";
  EXPECT_LE(honesty.published_, last.frames_estimated);
  // Honest by being silent would be no merit: all are published, and 59 to 66 % were converged in soaks of 90 s to
  // eight hours.
  EXPECT_GE(static_cast<double>(honesty.published_), 0.95 * static_cast<double>(last.frames_estimated));
  EXPECT_GT(static_cast<double>(honesty.converged_), 0.3 * static_cast<double>(honesty.published_));
  EXPECT_LE(arrived, sent);
  // 1.2 % in the hour of docs/reliability_evidence.md: held up for 3 s, or waiting for a processor, the service leaves
  // its socket full.
  EXPECT_GE(static_cast<double>(arrived), 0.95 * static_cast<double>(sent));
  EXPECT_EQ(dishonest, 0);

  // The first two minutes are warm-up.
  if (minutes.size() < 6) return;
  const std::vector<Minute> warm(minutes.begin() + 2, minutes.end());
  const std::size_t third = std::max<std::size_t>(1, warm.size() / 3);
  const auto part = [&](bool late, auto value) {
    std::vector<double> values;
    for (std::size_t i = 0; i < third; ++i) values.push_back(value(warm[late ? warm.size() - 1 - i : i]));
    return median(values);
  };
  const auto drift = [&](const char* what, auto value) {
    const double early = part(false, value);
    const double late = part(true, value);
    std::printf("%s: %.1f in the first third, %.1f in the last (%+.1f %%)\n", what, early, late,
                100.0 * (late / early - 1.0));
    return late / early - 1.0;
  };
  EXPECT_LE(drift("resident MiB", [](const Minute& m) { return m.rss_MiB; }), 0.02);
  EXPECT_LE(drift("processor time per estimate, ms", [](const Minute& m) { return m.cost_ms; }), 0.15);
  // Printed beside the machine's load and not judged: the clock on the wall counts other people's work too,
  // and not in proportion (a queue fills all at once). What drifts by itself shows in processor time.
  drift("latency, ms", [](const Minute& m) { return m.latency_ms; });
  drift("load of the machine", [](const Minute& m) { return m.load; });
}

}  // namespace
}  // namespace bodyschema::integration
