#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <fstream>
#include <random>
#include <set>

#include "bodyschema/service/health.hpp"
#include "harness.hpp"

/// The daemon as a user runs it: a process, fed over LCM.
namespace bodyschema::integration {
namespace {

using testing::HasSubstr;
using testing::Not;

class Service : public testing::Test {
 protected:
  void SetUp() override {
    static const std::string reason = why_no_lcm();
    if (!reason.empty()) GTEST_SKIP() << reason;
  }

  std::vector<std::string> daemon(std::vector<std::string> more = {}) const {
    std::vector<std::string> command = {"bodyschemad", "--config", reach_configuration(), "-l", url_};
    command.insert(command.end(), more.begin(), more.end());
    return command;
  }

  const std::string url_ = own_lcm_url();
  Scratch scratch_;
};

constexpr Seconds kStart{60};  // loading the robot, on a busy machine
/// After which a service that has nothing more to do may end.
const std::string kIdle_s = std::to_string(3.0 * patience());

/// Pictures and encoders as fast as the daemon keeps up: the next picture goes out once the
/// estimate for one three frames earlier is back, so that nothing is shed on any machine.
Player::Change in_step_with(const Listener& listener) {
  return [&listener, sent = std::size_t{0}](LogEvent& event, LcmLink&) mutable {
    if (event.channel != "ICUB_CAMERAS") return true;
    ++sent;
    for (int i = 0; i < 500 * patience() && listener.offsets().size() + 3 < sent; ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return true;
  };
}

TEST_F(Service, AgreesWithReplayBitForBit) {
  const auto log = reach_log();
  Listener listener(url_);
  const auto file = scratch_ / "estimates.jsonl";
  Process service(daemon({"--estimates", file.string(), "--stop-after-idle", kIdle_s}), scratch_.folder());
  ASSERT_TRUE(service.said("waiting for", kStart));
  Player player(url_, log, 1000.0, in_step_with(listener));
  player.wait();
  ASSERT_EQ(service.wait(Seconds(60)), 0);

  const auto statuses = listener.statuses();
  ASSERT_FALSE(statuses.empty());
  EXPECT_EQ(statuses.back().frames_dropped, 0);
  EXPECT_EQ(statuses.back().frames_in, statuses.back().frames_estimated);

  const auto live = estimates_by_utime(file);
  EXPECT_GT(live.size(), 40u);
  EXPECT_EQ(live, replay_estimates(log, scratch_ / "replay"));

  // What went over the network is what was written.
  const auto published = listener.offsets();
  ASSERT_EQ(published.size(), live.size());
  for (std::size_t i = 0; i < published.size(); ++i) {
    EXPECT_EQ(published[i].sequence, static_cast<std::int64_t>(i));
    EXPECT_TRUE(live.contains(published[i].utime));
    EXPECT_GE(published[i].latency_ms, 0.0);
  }
}

TEST_F(Service, AgreesWithReplayOnAnExtendedModelThatRemembers) {
  const auto model = scratch_ / "extended_model.yaml";
  std::ofstream(model) << R"(version: 1
effects:
  - {name: backlash, joint: r_elbow, parameters: {width_deg: 1.0}}
  - {name: latency, parameters: {delay_ms: 25}}
  - {name: compliance, joint: r_shoulder_pitch, parameters: {compliance_deg_per_Nm: 0.3}}
)";
  const auto log = reach_log();
  Listener listener(url_);
  const auto file = scratch_ / "estimates.jsonl";
  Process service(
      daemon({"--estimates", file.string(), "--stop-after-idle", kIdle_s, "--extended-model", model.string()}),
      scratch_.folder());
  ASSERT_TRUE(service.said("extended model: backlash of r_elbow width 1 deg; latency delay 25 ms", kStart))
      << service.err();
  ASSERT_TRUE(service.said("waiting for", kStart));
  Player player(url_, log, 1000.0, in_step_with(listener));
  player.wait();
  ASSERT_EQ(service.wait(Seconds(60)), 0);
  const auto live = estimates_by_utime(file);
  EXPECT_GT(live.size(), 40u);
  EXPECT_EQ(live, replay_estimates(log, scratch_ / "with", {"--extended-model", model.string()}));
  EXPECT_NE(live, replay_estimates(log, scratch_ / "without"));
}

TEST_F(Service, AgreesWithReplayOverLcmLogplayer) {
  if (std::system("command -v lcm-logplayer >/dev/null") != 0) GTEST_SKIP() << "lcm-logplayer is not installed";
  const auto log = reach_log();
  const auto expected = replay_estimates(log, scratch_ / "replay");
  // Real time where the machine keeps up, slower where it does not: the promise holds without drops.
  std::vector<std::string> speeds{"1", "0.25", "0.08"};
  if (patience() > 1.0) speeds = {"0.02"};
  for (const std::string& speed : speeds) {
    const std::string url = own_lcm_url();
    Listener listener(url);
    const auto file = scratch_ / ("estimates-" + speed + ".jsonl");
    Process service({"bodyschemad", "--config", reach_configuration(), "-l", url, "--estimates", file.string(),
                     "--stop-after-idle", kIdle_s},
                    scratch_.folder());
    ASSERT_TRUE(service.said("waiting for", kStart));
    Process player({"lcm-logplayer", "--speed", speed, "--lcm-url", url, log.string()}, scratch_.folder());
    ASSERT_EQ(player.wait(Seconds(150)), 0);
    ASSERT_EQ(service.wait(Seconds(30)), 0);
    const auto live = estimates_by_utime(file);
    ASSERT_FALSE(live.empty());
    if (listener.statuses().back().frames_dropped > 0 || live.size() != expected.size()) continue;
    EXPECT_EQ(live, expected) << "at speed " << speed;
    return;
  }
  FAIL() << "frames were lost even at " << speeds.back() << " of real time";
}

TEST_F(Service, TwoReplaysAreIdentical) {
  const auto log = reach_log();
  EXPECT_EQ(replay_estimates(log, scratch_ / "a"),
            replay_estimates(log, scratch_ / "b", {"--set", "silhouette.threads=1"}));
}

TEST_F(Service, MalformedMessagesAreCountedAndChangeNothing) {
  const auto log = reach_log();
  Listener listener(url_);
  const auto file = scratch_ / "estimates.jsonl";
  Process service(daemon({"--estimates", file.string(), "--stop-after-idle", kIdle_s}), scratch_.folder());
  ASSERT_TRUE(service.said("waiting for", kStart));
  auto in_step = in_step_with(listener);
  int sent = 0;
  Player player(url_, log, 1000.0, [&](LogEvent& event, LcmLink& link) {
    const std::vector<std::uint8_t> half(event.data.begin(),
                                         event.data.begin() + static_cast<std::ptrdiff_t>(event.data.size() / 2));
    const std::vector<std::uint8_t> noise(33, 0xA5);
    if (++sent % 10 == 0) {
      link.publish(event.channel, 0, half);
      link.publish(event.channel, 0, noise);
      link.publish(event.channel, 0, {});
    }
    return in_step(event, link);
  });
  player.wait();
  ASSERT_EQ(service.wait(Seconds(60)), 0);
  EXPECT_EQ(estimates_by_utime(file), replay_estimates(log, scratch_ / "replay"));
  const auto last = listener.statuses().back();
  EXPECT_EQ(counter(last, "malformed.truncated") + counter(last, "malformed.wrong_type"), 3 * (sent / 10));
  EXPECT_EQ(last.frames_dropped, 0);
}

TEST_F(Service, StopsWithinASecondIdleAndBusy) {
  for (const int number : {SIGTERM, SIGINT}) {
    for (const bool busy : {false, true}) {
      const std::string url = own_lcm_url();
      Listener listener(url);
      Process service({"bodyschemad", "--config", reach_configuration(), "-l", url}, scratch_.folder());
      ASSERT_TRUE(service.said("waiting for", kStart));
      Player player(url, reach_log(), 1.0, [busy](LogEvent&, LcmLink&) { return busy; });
      if (busy) {
        ASSERT_TRUE(listener.wait_offsets(3, Seconds(20)));
      }
      const auto begin = std::chrono::steady_clock::now();
      service.signal(number);
      EXPECT_EQ(service.wait(Seconds(20)), 0);
      const double took_s = Seconds(std::chrono::steady_clock::now() - begin).count();
      EXPECT_LT(took_s, 1.0 * patience()) << (busy ? "busy" : "idle");
      EXPECT_THAT(service.err(), HasSubstr("stopped after"));
    }
  }
}

TEST_F(Service, CountsTheFramesThatWaitWhenItStops) {
  Listener listener(url_);
  Process service({"bodyschemad", "--config", reach_configuration(), "-l", url_, "--frames", "3"}, scratch_.folder());
  ASSERT_TRUE(service.said("waiting for", kStart));
  const Player player(url_, reach_log(), 1000.0);
  ASSERT_EQ(service.wait(Seconds(60)), 0);
  ASSERT_FALSE(listener.statuses().empty());
  const auto last = listener.statuses().back();
  EXPECT_GT(counter(last, "left"), 0) << "a test that shows nothing";
  EXPECT_EQ(pictures_unaccounted_for(last), 0);
}

TEST_F(Service, StopsWhileReloading) {
  const auto config = scratch_ / "estimator.yaml";
  std::ofstream(config) << "include: [" << reach_configuration() << "]\n";
  const auto record = scratch_ / "stopped.lcmlog";
  Process service({"bodyschemad", "--config", config.string(), "-l", url_, "--record", record.string()},
                  scratch_.folder());
  ASSERT_TRUE(service.said("waiting for", kStart));
  // A load without end: it reads from a pipe that nobody writes to.
  const auto pipe = scratch_ / "extended_model.yaml";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  std::ofstream(config) << "include: [" << reach_configuration() << "]\n"
                        << "robot: {extended_model: " << pipe << "}\n";
  service.signal(SIGHUP);
  ASSERT_TRUE(service.said("reloading the configuration", Seconds(5)));
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  service.signal(SIGTERM);
  EXPECT_EQ(service.wait(Seconds(20)), 0) << "the load has no end, so neither would a stop that waits for it";
  EXPECT_THAT(service.err(), HasSubstr("stopped after"));
  EXPECT_THAT(service.err(), Not(HasSubstr("reload refused"))) << "the load was not under way";
  LogReader log(record);
  LogEvent event;
  EXPECT_TRUE(log.next(event)) << "its last status";
}

TEST_F(Service, TellsTheManagerWhenItIsReadyAndAlive) {
  const std::string name = "@bodyschema-integration-" + std::to_string(getpid());
  const int manager = socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::memcpy(address.sun_path + 1, name.data() + 1, name.size() - 1);
  ASSERT_EQ(bind(manager, reinterpret_cast<const sockaddr*>(&address),
                 static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + name.size())),
            0);
  std::string heard;
  const auto hears = [&](const std::string& words, double limit_s) {
    for (int i = 0; i < limit_s * 100; ++i) {
      char text[4096];
      for (ssize_t n; (n = recv(manager, text, sizeof text, 0)) > 0;)
        heard.append(text, static_cast<std::size_t>(n)).append("\n");
      if (heard.find(words) != std::string::npos) return true;
      usleep(10'000);
    }
    return false;
  };

  Process service(daemon(), scratch_.folder(), {{"NOTIFY_SOCKET", name}, {"WATCHDOG_USEC", "2000000"}});
  ASSERT_TRUE(service.said("waiting for", kStart));
  EXPECT_TRUE(hears("WATCHDOG=1", 5.0)) << "the watchdog is fed while idle";
  EXPECT_TRUE(hears("STATUS=STALE: no pictures yet", 5.0));
  EXPECT_EQ(heard.find("READY=1"), std::string::npos) << "ready before anything came";
  Player player(url_, reach_log());
  EXPECT_TRUE(hears("READY=1", 20.0));
  heard.clear();
  EXPECT_TRUE(hears("WATCHDOG=1", 5.0)) << "the watchdog is fed while busy";
  heard.clear();
  service.signal(SIGHUP);
  EXPECT_TRUE(hears("RELOADING=1", 5.0));
  EXPECT_TRUE(hears("READY=1", 60.0));
  service.signal(SIGTERM);
  EXPECT_TRUE(hears("STOPPING=1", 5.0));
  EXPECT_EQ(service.wait(Seconds(10)), 0);
  close(manager);
}

TEST_F(Service, ReloadsOnSighupAndRefusesABrokenConfiguration) {
  const auto config = scratch_ / "estimator.yaml";
  const auto write = [&](const std::string& more) {
    std::ofstream(config) << "include: [" << reach_configuration() << "]\n" << more;
  };
  write("filter: {particles: 40}\n");
  Listener listener(url_);
  Process service({"bodyschemad", "--config", config.string(), "-l", url_}, scratch_.folder());
  ASSERT_TRUE(service.said("waiting for", kStart));
  const auto particles = [](int n) { return [n](const offsets_status_t& s) { return s.num_particles == n; }; };
  ASSERT_TRUE(listener.wait_status(particles(40), Seconds(5)));

  write("filter: {particel: 60}\n");
  service.signal(SIGHUP);
  EXPECT_TRUE(service.said("reload refused, going on as before: ", kStart));
  EXPECT_THAT(service.err(), HasSubstr("did you mean 'filter.particles'?"));
  EXPECT_TRUE(listener.wait_status(particles(40), Seconds(5)));

  // A mesh no silhouette can be drawn of.
  std::ofstream(scratch_ / "far.obj") << "v 0 0 0\nv 1e7 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
  std::ofstream(scratch_ / "far.urdf")
      << R"(<robot name="r"><link name="part"><visual><geometry><mesh filename="far.obj"/></geometry></visual></link>)"
      << R"(<link name="k"/><joint name="j" type="continuous"><parent link="part"/><child link="k"/>)"
      << R"(<axis xyz="1 0 0"/></joint></robot>)";
  std::ofstream(config) << "version: 1\nrobot: {urdf: far.urdf, rendered_links: [part], hand_link: part, "
                           "estimated_joints: [j]}\n"
                           "cameras: {left: {link: part, width: 64, height: 48, fx: 50, fy: 50, cx: 32, cy: 24}}\n";
  service.signal(SIGHUP);
  EXPECT_TRUE(service.said("silhouette part 0 'part' has a vertex", kStart)) << service.err();
  EXPECT_TRUE(service.running());

  write("filter: {particles: 60}\n");
  service.signal(SIGHUP);
  EXPECT_TRUE(listener.wait_status(particles(60), kStart));
  // Two in a row: the second is not lost, whatever the first has read by then.
  write("filter: {particles: 70}\n");
  service.signal(SIGHUP);
  usleep(250'000);
  write("filter: {particles: 80}\n");
  service.signal(SIGHUP);
  EXPECT_TRUE(listener.wait_status(particles(80), kStart));
  Player player(url_, reach_log());
  EXPECT_TRUE(listener.wait_offsets(1, Seconds(20))) << "the reloaded service works";
  service.signal(SIGTERM);
  EXPECT_EQ(service.wait(Seconds(10)), 0);
}

#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
/// Heaps of glibc's arenas beside the main one. Each reserves 64 MiB on a multiple of 64 MiB: what is used of it
/// can be written, the rest, which follows at once, cannot be read. (That other mappings begin there by chance is
/// less rare than one thinks: Linux lays those of whole huge pages on multiples of 2 MiB.)
int arenas_of(pid_t pid) {
  constexpr std::uint64_t kHeap = 64u << 20;
  int arenas = 0;
  std::uint64_t used_from = 0;
  std::uint64_t used_to = 0;
  std::ifstream maps("/proc/" + std::to_string(pid) + "/maps");
  for (std::string line; std::getline(maps, line);) {
    std::size_t dash = 0;
    const std::uint64_t begin = std::stoull(line, &dash, 16);
    const std::uint64_t end = std::stoull(line.substr(dash + 1), nullptr, 16);
    const bool nameless = line.find_first_of("/[") == std::string::npos;
    if (nameless && begin % kHeap == 0 && line.find(" rw-p ") != std::string::npos) {
      used_from = begin;
      used_to = end;
    } else if (nameless && used_to == begin && used_to < used_from + kHeap && end >= used_from + kHeap &&
               line.find(" ---p ") != std::string::npos) {
      ++arenas;
    }
  }
  return arenas;
}

TEST_F(Service, ItsThreadsShareTwoArenas) {
  // One for each thread, kept and handed on, let memory rise in steps for hours.
  Listener listener(url_);
  Process service(daemon(), scratch_.folder());
  ASSERT_TRUE(service.said("waiting for", kStart));
  Player player(url_, reach_log());
  ASSERT_TRUE(listener.wait_offsets(20, Seconds(30)));
  EXPECT_LE(arenas_of(service.pid()), 1);
}
#endif

/// Messages by channel of a log without damage. The message that was being written as its writer was killed may be
/// cut short: the kernel ends a long write page by page.
std::map<std::string, int> recorded(const std::filesystem::path& file) {
  LogReader log(file);
  LogEvent event;
  std::map<std::string, int> seen;
  std::uint64_t end_of_last = 0;
  while (log.next(event)) {
    ++seen[event.channel];
    end_of_last = log.position();
  }
  EXPECT_EQ(log.skipped_bytes(), log.size() - end_of_last) << file;
  return seen;
}

TEST_F(Service, RecordingIsReadableUpToTheLastMessageWhenKilled) {
  // Killed at random moments and each time started again by the same command, as systemd does it.
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  const auto record = scratch_ / "killed.lcmlog";
  const auto estimates = scratch_ / "estimates.jsonl";
  Listener listener(url_);
  constexpr int kTimes = 3;
  for (int i = 0; i < kTimes; ++i) {
    Process service(daemon({"--record", record.string(), "--estimates", estimates.string()}), scratch_.folder());
    ASSERT_TRUE(service.said("waiting for", kStart));
    Player player(url_, reach_log());
    ASSERT_TRUE(listener.wait_offsets(listener.offsets().size() + 10, Seconds(30)));
    std::this_thread::sleep_for(std::chrono::microseconds(random() % 200'000));
    service.signal(SIGKILL);
    EXPECT_EQ(service.wait(Seconds(5)), 128 + SIGKILL);
  }
  for (int i = 0; i < kTimes; ++i) {
    const std::string part = i == 0 ? "" : "." + std::to_string(i);
    auto seen = recorded(scratch_ / ("killed" + part + ".lcmlog"));
    EXPECT_GE(seen["ICUB_JOINT_OFFSETS"], 8) << "at most what was on its way to the disk is missing";
    EXPECT_GE(seen["ICUB_CAMERAS"], 8);
    EXPECT_GE(seen["ICUB_JOINT_STATE"], 8);
    std::ifstream lines(scratch_ / ("estimates" + part + ".jsonl"));
    EXPECT_GE(std::count(std::istreambuf_iterator<char>(lines), {}, '\n'), 8);
  }
}

TEST_F(Service, EstimatesThatCannotBeWrittenAreSaidAtOnce) {
  if (access("/dev/full", W_OK) != 0) GTEST_SKIP() << "this machine has no /dev/full";
  Listener listener(url_);
  Process service(daemon({"--estimates", "/dev/full"}), scratch_.folder());
  ASSERT_TRUE(service.said("waiting for", kStart));
  Robot robot(url_, reach_log(), 0.5);
  const auto told = listener.wait_status(
      [](const offsets_status_t& s) {
        return s.sentence.find("writing of estimates has ended: /dev/full") != std::string::npos;
      },
      Seconds(20));
  ASSERT_TRUE(told) << service.err();
  EXPECT_NE(told->state, "converged") << "not only once nothing else is to be said";
  const auto estimates = listener.offsets().size();
  EXPECT_TRUE(listener.wait_offsets(estimates + 10, Seconds(20))) << "estimating goes on";
}

// Systemd does not try again after exit status 2, and a disk may have room again.
TEST_F(Service, FilesThatAFullDiskDoesNotTakeAreNoWrongInput) {
  for (const std::string option : {"--record", "--estimates"}) {
    const auto disk = scratch_ / "disk";
    std::filesystem::create_directories(disk);
    // A file system of its own, with room for its own folder only.
    const std::string program = std::string(BODYSCHEMA_BINARY_DIR) + "/bin/bodyschemad";
    Process service(
        {"unshare", "-rm", "sh", "-c",
         "mount -t tmpfs -o size=64k,nr_inodes=1 full \"$1\" || exit 77; shift; exec \"$@\"", "sh", disk.string(),
         program, "--config", reach_configuration(), "-l", url_, option, (disk / "file").string()},
        scratch_.folder());
    const auto status = service.wait(kStart);
    if (status == 77 || status == 127 || (status && service.err().find("unshare") != std::string::npos)) {
      GTEST_SKIP() << "no file system can be mounted here: " << service.err();
    }
    EXPECT_EQ(status, 1) << service.err();
    EXPECT_THAT(service.err(), HasSubstr("disk/file: cannot be created: No space left on device"));
  }
}

// Nor where the disk has no room for a name.
TEST_F(Service, AFullDiskIsNoWrongInputOfAnyCommand) {
  const std::string programs = std::string(BODYSCHEMA_BINARY_DIR) + "/bin/";
  const std::string short_log = std::string(BODYSCHEMA_SOURCE_DIR) + "/test/pipeline/logs/version_0_1_0.lcmlog";
  const std::string simulator = std::string(BODYSCHEMA_SOURCE_DIR) + "/config/icub_right/simulator.yaml";
  const std::string disk = (scratch_ / "disk").string(), log = (scratch_ / "no.lcmlog").string();
  std::filesystem::create_directories(disk);
  const std::vector<std::vector<std::string>> commands = {
      {"bodyschema", "replay", short_log, "--config", reach_configuration(), "--out", disk},
      {"bodyschema", "replay", short_log, "--config", reach_configuration(), "--out", disk + "/folder"},
      {"bodyschema", "diagnose", short_log, "--config", reach_configuration(), "--out", disk},
      {"bodyschema", "evaluate", "likelihood", "--out", disk},
      {"bodyschema", "log", "to-mcap", short_log, "--out", disk + "/log.mcap"},
      {"bodyschema-sim", "--config", simulator, "--frames", "2", "--log", disk + "/log"},
      {"bodyschema-sim", "--config", simulator, "--frames", "2", "--log", log, "--truth", disk + "/truth.json"}};
  for (const auto& command : commands) {
    std::vector<std::string> words = {
        "unshare",
        "-rm",
        "sh",
        "-c",
        "mount -t tmpfs -o size=64k,nr_inodes=1 full \"$1\" || exit 77; shift; exec \"$@\"",
        "sh",
        disk,
        programs + command.front()};
    words.insert(words.end(), command.begin() + 1, command.end());
    Process process(words, scratch_.folder());
    const auto status = process.wait(kStart);
    if (status == 77 || status == 127 || (status && process.err().find("unshare") != std::string::npos)) {
      GTEST_SKIP() << "no file system can be mounted here: " << process.err();
    }
    EXPECT_EQ(status, 1) << command[1] << ": " << process.err();
    EXPECT_THAT(process.err(), HasSubstr("cannot be written: No space left on device")) << command[1];
  }
}

TEST_F(Service, StatusFollowsWhatHappens) {
  Listener listener(url_);
  Process service(daemon(), scratch_.folder());
  ASSERT_TRUE(service.said("waiting for", kStart));
  const auto says = [](HealthLevel level, const std::string& words) {
    return [=](const offsets_status_t& s) {
      return s.level == static_cast<int>(level) && s.sentence.find(words) != std::string::npos;
    };
  };
  EXPECT_TRUE(listener.wait_status(says(HealthLevel::kStale, "no pictures yet on ICUB_CAMERAS"), Seconds(5)));
  {
    Player player(url_, reach_log(), 1.0 / patience());
    ASSERT_TRUE(listener.wait_status(says(HealthLevel::kWarn, "hand not in view"), Seconds(10)));
    // Frames are shed on a slow machine, which the sentence may say instead; the state is there too.
    const auto tracking =
        listener.wait_status([](const offsets_status_t& status) { return status.state == "converged"; }, Seconds(20));
    ASSERT_TRUE(tracking);
    EXPECT_LE(tracking->level, offsets_status_t::WARN) << tracking->sentence;
    EXPECT_GT(tracking->frame_rate_hz, 1.0 / patience());
    EXPECT_GT(tracking->latency_median_ms, 0.0);
    EXPECT_GT(tracking->resident_bytes, 1'000'000);
    EXPECT_GT(tracking->best_likelihood, 0.8);
    EXPECT_EQ(tracking->config_hash.size(), tracking->model_hash.size());
    player.wait();
  }
  const auto silent = listener.wait_status(
      [](const offsets_status_t& status) {
        return status.sentence.find("no pictures on ICUB_CAMERAS for") != std::string::npos &&
               status.frames_in == status.frames_estimated + status.frames_dropped;
      },
      Seconds(10));
  ASSERT_TRUE(silent);
  std::int64_t estimates = 0;
  for (const auto count : silent->latency_count) estimates += count;
  EXPECT_EQ(estimates, silent->frames_estimated);
  EXPECT_EQ(silent->level, offsets_status_t::STALE);
}

TEST_F(Service, StatusCarriesTheTimeOfEveryStageAndWhatIsRunning) {
  Listener listener(url_);
  Process service(daemon(), scratch_.folder());
  ASSERT_TRUE(service.said("waiting for", kStart));
  Robot robot(url_, reach_log(), 0.5);
  const auto status = listener.wait_status(
      [](const offsets_status_t& s) { return s.state == "converged" && s.frames_estimated > 30; }, Seconds(60));
  if (!status && listener.statuses().back().frames_dropped > 0) GTEST_SKIP() << "this machine is too busy";
  ASSERT_TRUE(status);
  std::map<std::string, double> median, p99;
  for (std::size_t i = 0; i < status->stage_name.size(); ++i) {
    median[status->stage_name[i]] = status->stage_median_ms[i];
    p99[status->stage_name[i]] = status->stage_p99_ms[i];
  }
  for (const char* stage : {"segmentation", "scoring", "refinement", "latency"}) {
    ASSERT_TRUE(median.contains(stage)) << stage;
    EXPECT_GT(p99[stage], 0.0) << stage;
    EXPECT_GE(p99[stage], median[stage]) << stage;
    EXPECT_LE(median[stage], p99["latency"]) << stage;
  }
  ASSERT_EQ(status->latency_bin_upper_ms.size(), status->latency_count.size());
  EXPECT_TRUE(std::is_sorted(status->latency_bin_upper_ms.begin(), status->latency_bin_upper_ms.end()));
  EXPECT_THAT(status->model_hash, testing::MatchesRegex("[0-9a-f]+"));
  EXPECT_THAT(status->config_hash, testing::MatchesRegex("[0-9a-f]+"));
  EXPECT_THAT(status->weakest_direction, testing::ContainsRegex("r_[a-z_]+.*: sd [0-9.]+ deg"));
  if (status->level == offsets_status_t::OK) {  // on a slow machine the sentence tells of that instead
    EXPECT_THAT(status->sentence, HasSubstr("weakest " + status->weakest_direction));
  }
  const auto published = listener.offsets();
  ASSERT_FALSE(published.empty());
  EXPECT_EQ(published.back().model_hash, status->model_hash);
  EXPECT_EQ(published.back().config_hash, status->config_hash);
  service.signal(SIGTERM);
  EXPECT_EQ(service.wait(Seconds(10)), 0);
}

TEST_F(Service, SaysWhichCameraSeesNothingOfTheArm) {
  bot_core::images_t empty;  // the first pictures of the log show the background alone
  LogReader log(reach_log());
  for (LogEvent event; log.next(event);) {
    if (event.channel != "ICUB_CAMERAS") continue;
    ASSERT_GT(empty.decode(event.data.data(), 0, static_cast<int>(event.data.size())), 0);
    break;
  }
  Listener listener(url_);
  Process service(daemon(), scratch_.folder());
  ASSERT_TRUE(service.said("waiting for", kStart));
  Robot robot(url_, reach_log(), 0.5);
  ASSERT_TRUE(listener.wait_status([](const offsets_status_t& s) { return s.state == "converged"; }, Seconds(60)));
  int n = 0;
  robot.set_faults({.pictures =
                        [&](bot_core::images_t& pictures, LcmLink&) {
                          pictures.images[0].data = empty.images[0].data;
                          pictures.images[0].data[0] = static_cast<std::uint8_t>(++n);  // not frozen, only empty
                          return true;
                        },
                    .joints = {}});
  EXPECT_TRUE(listener.wait_status(
      [](const offsets_status_t& s) {
        return s.level == offsets_status_t::WARN && s.sentence == "mask empty in the left camera";
      },
      Seconds(20)))
      << listener.statuses().back().sentence;
  robot.set_faults({});
  service.signal(SIGTERM);
  EXPECT_EQ(service.wait(Seconds(10)), 0);
}

TEST_F(Service, WrongInputEndsWithOneClearErrorAndStatusTwo) {
  struct Case {
    std::vector<std::string> arguments;
    std::string words;
  };
  const std::string good = reach_configuration();
  std::ofstream(scratch_ / "not.yaml") << "robot: [1, 2\n";
  std::ofstream(scratch_ / "no_urdf.yaml") << "include: [" << good << "]\nrobot: {urdf: missing.urdf}\n";
  const std::vector<Case> cases = {
      {{}, "--config is required"},
      {{"--config", "missing.yaml"}, "missing.yaml: no such configuration file"},
      {{"--config", (scratch_ / "not.yaml").string()}, "not.yaml"},
      {{"--config", (scratch_ / "no_urdf.yaml").string()}, "missing.urdf"},
      {{"--config", good, "--set", "filter.particel=5"}, "did you mean 'filter.particles'?"},
      {{"--config", good, "--set", "filter.particles=-5"}, "filter.particles"},
      {{"--config", good, "--set", "robot.estimated_joints=[r_elbo]"}, "r_elbow"},
      {{"--config", good, "--engine", "magic"}, "--engine"},
      {{"--config", good, "--record", "/nowhere/at/all.lcmlog"}, "/nowhere/at/all.lcmlog"},
      {{"--config", good, "--estimates", "/nowhere/at/all.jsonl"}, "/nowhere/at/all.jsonl"},
      {{"--config", good, "--record", (scratch_ / "one").string(), "--estimates", (scratch_ / "one").string()},
       "--record and --estimates would both write to " + (scratch_ / "one").string()},
      {{"--config", good, "--stop-after-idle", "soon"}, "--stop-after-idle"},
  };
  for (const auto& [arguments, words] : cases) {
    std::vector<std::string> command = {"bodyschemad", "-l", url_};
    command.insert(command.end(), arguments.begin(), arguments.end());
    Process service(command, scratch_.folder());
    EXPECT_EQ(service.wait(kStart), 2) << words;
    EXPECT_THAT(service.err(), HasSubstr(words));
    EXPECT_EQ(service.out(), "") << words;
  }
  Process service({"bodyschemad", "--config", good, "-l", "nonsense://"}, scratch_.folder());
  EXPECT_EQ(service.wait(kStart), 1);
  EXPECT_THAT(service.err(), HasSubstr("LCM cannot use 'nonsense://'"));
}

TEST(SimulatedLog, HoldsLargePicturesAsJpeg) {
  const std::string simulator = std::string(BODYSCHEMA_SOURCE_DIR) + "/config/icub_right/simulator.yaml";
  const Scratch scratch;
  const auto formats = [&](const std::vector<std::string>& more) {
    const auto log = scratch / "hd.lcmlog";
    std::filesystem::remove(log);
    std::vector<std::string> command = {"bodyschema-sim",      "--config", simulator, "--frames",  "2",
                                        "--background-frames", "0",        "--log",   log.string()};
    for (const char* size : {"left.width=960", "left.height=540", "right.width=960", "right.height=540"}) {
      command.insert(command.end(), {"--set", std::string("cameras.") + size});
    }
    command.insert(command.end(), more.begin(), more.end());
    Process sim(command, scratch.folder());
    EXPECT_EQ(sim.wait(kStart), 0) << sim.err();
    std::set<int> found;
    LogReader reader(log);
    LogEvent event;
    while (reader.next(event)) {
      bot_core::images_t pictures;
      if (event.channel != "ICUB_CAMERAS") continue;
      EXPECT_GT(pictures.decode(event.data.data(), 0, static_cast<int>(event.data.size())), 0);
      for (const auto& picture : pictures.images) found.insert(picture.pixelformat);
    }
    return found;
  };
  EXPECT_EQ(formats({}), std::set<int>{bot_core::image_t::PIXEL_FORMAT_MJPEG});
  EXPECT_EQ(formats({"--pictures", "rgb"}), std::set<int>{bot_core::image_t::PIXEL_FORMAT_RGB});
}

/// Of all programs.
TEST_F(Service, NumbersThatAreNoneAreRefusedByOptionAndValue) {
  const std::string simulator = std::string(BODYSCHEMA_SOURCE_DIR) + "/config/icub_right/simulator.yaml";
  const std::vector<std::string> daemon = {"bodyschemad", "--config", reach_configuration(), "-l", url_};
  const std::vector<std::string> sim = {"bodyschema-sim", "--config", simulator, "--log",
                                        (scratch_ / "no.log").string()};
  const std::vector<std::string> diagnose = {
      "bodyschema", "diagnose", "no.log", "--config", reach_configuration(), "--out", (scratch_ / "out").string()};
  struct Case {
    std::vector<std::string> program;
    std::string option, value;
  };
  const std::vector<Case> cases = {
      {daemon, "--stop-after-idle", "nan"},
      {daemon, "--stop-after-idle", "inf"},
      {daemon, "--frames", "-1"},
      {daemon, "--frames", "99999999999999999999"},
      {daemon, "--page", "0"},
      {sim, "--babble", "nan"},
      {sim, "--rate", "nan"},
      {sim, "--hidden-size", "nan"},
      {sim, "--seed", "-1"},
      {sim, "--hidden-fault", "-1"},
      {sim, "--frames", "1"},
      {sim, "--offsets", "nan,0,0,0,0,0,0"},
      {sim, "--offsets", "inf,0,0,0,0,0,0"},
      {diagnose, "--picture-rate", "nan"},
      {diagnose, "--threads", "-1"},
      {{"bodyschema", "evaluate", "paper", "--out", (scratch_ / "out").string()}, "--seed", "-1"},
      {{"bodyschema", "new-robot", "no.urdf", "--hand", "h", "--camera", "c", "--out", "out"}, "--focal", "nan"},
      {{"bodyschema", "log", "to-mcap", "no.log", "--out", "no.mcap"}, "--jpeg-quality", "101"},
  };
  for (const auto& [program, option, value] : cases) {
    std::vector<std::string> command = program;
    if (option == "--rate") command.resize(3);  // not with --log
    command.insert(command.end(), {option, value});
    Process process(command, scratch_.folder());
    EXPECT_EQ(process.wait(kStart), 2) << option << ' ' << value;
    EXPECT_THAT(process.err(), HasSubstr(option + ": '" + value.substr(0, value.find(',')))) << program.front();
  }
}

/// The systemd unit and scripts tell what to do next by it.
TEST_F(Service, ExitStatusMeansTheSameInEveryProgram) {
  const std::string simulator = std::string(BODYSCHEMA_SOURCE_DIR) + "/config/icub_right/simulator.yaml";
  const std::string log = (scratch_ / "no.lcmlog").string(), out = (scratch_ / "out").string();
  const std::string short_log = std::string(BODYSCHEMA_SOURCE_DIR) + "/test/pipeline/logs/version_0_1_0.lcmlog";
  // A disk that is full once all the work is done.
  const std::filesystem::path full = scratch_ / "full";
  std::filesystem::create_directories(full);
  for (const char* name : {"summary.json", "truth.json", "log.mcap"}) {
    std::filesystem::create_symlink("/dev/full", full / name);
  }
  struct Case {
    int status;
    std::vector<std::string> command;
    std::string words;
  };
  const std::vector<Case> cases = {
      {2,
       {"bodyschemad", "--config", reach_configuration(), "-l", url_, "--set", "robot.urdf=missing.urdf"},
       "missing.urdf"},
      {2, {"bodyschema-sim", "--config", simulator, "--log", log, "--set", "robot.urdf=missing.urdf"}, "missing.urdf"},
      {2,
       {"bodyschema", "replay", "missing.lcmlog", "--config", reach_configuration(), "--out", out},
       "missing.lcmlog"},
      {3,
       {"bodyschema-sim", "--config", simulator, "--log", log, "--set", "simulator.motion.distance_min_m=1.9", "--set",
        "simulator.motion.distance_max_m=2"},
       "no reach found"},
      {1,
       {"bodyschema", "replay", short_log, "--config", reach_configuration(), "--set", "vision.learning_frames=5",
        "--out", full.string()},
       "summary.json: cannot be written: No space left on device"},
      {1,
       {"bodyschema-sim", "--config", simulator, "--frames", "2", "--log", log, "--truth",
        (full / "truth.json").string()},
       "truth.json: cannot be written"},
      {1, {"bodyschema", "log", "to-mcap", short_log, "--out", (full / "log.mcap").string()}, "log.mcap: cut short"},
  };
  for (const auto& [status, command, words] : cases) {
    Process process(command, scratch_.folder());
    EXPECT_EQ(process.wait(kStart), status) << command.front();
    EXPECT_THAT(process.err(), HasSubstr(command.front() + ": error: "));
    EXPECT_THAT(process.err(), HasSubstr(words));
  }
}

TEST_F(Service, ChecksAndPrintsTheConfigurationWithoutTheNetwork) {
  Process check(daemon({"--check-config"}), scratch_.folder());
  EXPECT_EQ(check.wait(kStart), 0);
  EXPECT_THAT(check.out(), HasSubstr("good"));
  EXPECT_THAT(check.out(), HasSubstr("ICUB_JOINT_STATE and ICUB_CAMERAS in"));
  Process wrong({"bodyschemad", "--config", reach_configuration(), "--check-config", "-l", "nonsense://"},
                scratch_.folder());
  EXPECT_EQ(wrong.wait(kStart), 0) << "the configuration is good all the same";
  EXPECT_THAT(wrong.out(), HasSubstr("network: LCM cannot use 'nonsense://'"));
  Process print(daemon({"--print-config", "--set", "filter.particles=77"}), scratch_.folder());
  EXPECT_EQ(print.wait(kStart), 0);
  EXPECT_THAT(print.out(), HasSubstr("particles: 77"));
}

}  // namespace
}  // namespace bodyschema::integration
