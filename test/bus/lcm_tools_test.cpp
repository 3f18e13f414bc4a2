// lcm-logger and lcm-logplayer, as shipped by Debian, record and play our channels.

#include <gtest/gtest.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <thread>

#include "bodyschema/bus/lcm_link.hpp"
#include "bodyschema/bus/log.hpp"
#include "bodyschema/bus/observation_stream.hpp"
#include "bodyschema/core/error.hpp"
#include "own_port.hpp"

extern char** environ;

namespace bodyschema {
namespace {

constexpr Microseconds kMs = 1000;

/// A child process, ended with the test.
class Process {
 public:
  explicit Process(std::vector<std::string> words) {
    std::vector<char*> arguments;
    for (auto& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    if (posix_spawn(&pid_, arguments[0], nullptr, nullptr, arguments.data(), environ) != 0) pid_ = -1;
  }
  ~Process() { stop(); }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;
  void stop() {
    if (pid_ <= 0) return;
    kill(pid_, SIGINT);
    wait();
  }
  int wait() {
    int status = -1;
    if (pid_ > 0) waitpid(pid_, &status, 0);
    pid_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  [[nodiscard]] bool started() const { return pid_ > 0; }

 private:
  pid_t pid_ = -1;
};

struct Sent {
  std::string channel;
  std::vector<std::uint8_t> data;
  Microseconds utime;
  friend bool operator==(const Sent& a, const Sent& b) { return a.channel == b.channel && a.data == b.data; }
};

/// A second of encoders at 100 Hz and pictures at 25 Hz.
std::vector<Sent> messages() {
  std::vector<Sent> list;
  for (int i = 0; i <= 100; ++i) {
    bot_core::joint_state_t joints;
    joints.utime = 10 * i * kMs;
    joints.num_joints = 2;
    joints.joint_name = {"arm", "neck"};
    joints.joint_position = {0.01F * static_cast<float>(i), 0.0F};
    joints.joint_velocity = {1.0F, 0.0F};
    joints.joint_effort = {0.0F, 0.0F};
    list.push_back({"ICUB_JOINT_STATE", encode(joints), joints.utime});
    if (i % 4 != 1) continue;
    bot_core::images_t images;
    images.utime = joints.utime + 5 * kMs;
    images.n_images = 2;
    images.image_types = {bot_core::images_t::LEFT, bot_core::images_t::RIGHT};
    Image image(64, 48, 3);
    image.data[0] = static_cast<std::uint8_t>(i);
    images.images = {to_message(image, images.utime), to_message(image, images.utime + 2 * kMs)};
    list.push_back({"ICUB_CAMERAS", encode(images), images.utime});
  }
  return list;
}

std::vector<double> observations_of(const std::vector<Sent>& list) {
  std::vector<CameraModel> rig(2);
  rig[0].name = "left";
  rig[1].name = "right";
  for (auto& camera : rig) camera.intrinsics = {64, 48, 50.0, 50.0, 31.5, 23.5};
  ObservationStream stream({"arm", "neck"}, {}, rig, {});
  std::vector<double> result;
  for (const Sent& sent : list) {
    stream.receive(sent.channel, sent.data);
    while (auto arrived = stream.next()) {
      for (const auto& camera : arrived->observation.cameras) {
        result.push_back(static_cast<double>(camera->utime));
        result.push_back(camera->joints.q[0]);
        result.push_back(camera->image.data[0]);
      }
    }
  }
  return result;
}

class LcmTools : public ::testing::Test {
 protected:
  void SetUp() override {
    if (std::string(BODYSCHEMA_LCM_LOGGER).find("NOTFOUND") != std::string::npos ||
        std::string(BODYSCHEMA_LCM_LOGPLAYER).find("NOTFOUND") != std::string::npos) {
      GTEST_SKIP() << "lcm-logger and lcm-logplayer come with the package liblcm-bin, which is not installed "
                      "(scripts/setup brings it)";
    }
    directory_ = std::filesystem::temp_directory_path() / ("bodyschema_lcm_tools_" + std::to_string(getpid()));
    std::filesystem::create_directories(directory_);
    url_ = own_lcm_url();
    try {
      LcmLink probe(url_);
      probe.subscribe("PROBE", 1, [](const auto&, auto, auto) {});
    } catch (const DeviceError& e) {
      GTEST_SKIP() << "LCM needs a multicast route (scripts/multicast adds it): " << e.what();
    }
  }
  void TearDown() override {
    if (!directory_.empty()) std::filesystem::remove_all(directory_);
  }

  /// Reads what is in the log so far, but for the greeting that finds out whether it is recording.
  static std::vector<Sent> content(const std::filesystem::path& log) {
    std::vector<Sent> list;
    LogReader reader(log);
    LogEvent event;
    while (reader.next(event)) {
      if (event.channel != "GREETING") list.push_back({event.channel, event.data, 0});
    }
    return list;
  }
  template <class Condition>
  static bool until(Condition condition) {
    for (int i = 0; i < 500; ++i) {
      if (condition()) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    return false;
  }
  std::filesystem::path directory_;
  std::string url_;
};

TEST_F(LcmTools, LoggerRecordsWhatWePublish) {
  const auto log = directory_ / "recorded.log";
  const std::vector<std::uint8_t> greeting{1, 2, 3};
  // The long option: LCM 1.3's logger documents -l and refuses it.
  Process logger({BODYSCHEMA_LCM_LOGGER, "-q", "--lcm-url=" + url_, "--flush-interval=20", log});
  ASSERT_TRUE(logger.started());
  LcmLink link(url_);
  ASSERT_TRUE(until([&] {
    link.publish("GREETING", 0, greeting);
    return std::filesystem::exists(log) && std::filesystem::file_size(log) > 0;
  }));
  const auto sent = messages();
  for (const Sent& message : sent) {
    link.publish(message.channel, message.utime, message.data);
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  // The logger writes out what it holds when more comes.
  EXPECT_TRUE(until([&] {
    link.publish("GREETING", 0, greeting);
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    return content(log).size() >= sent.size();
  }));
  logger.stop();
  EXPECT_EQ(content(log), sent);
}

TEST_F(LcmTools, LogplayerPlaysWhatWeRecord) {
  const auto log = directory_ / "ours.log";
  const auto sent = messages();
  {
    LogWriter writer(log);
    for (const Sent& message : sent) writer.publish(message.channel, message.utime, message.data);
  }
  std::vector<Sent> received;
  LcmLink link(url_);
  for (const char* channel : {"ICUB_JOINT_STATE", "ICUB_CAMERAS"}) {
    link.subscribe(channel, 1000, [&](const std::string& name, Bytes data, std::int64_t arrival_us) {
      received.push_back({name, {data.begin(), data.end()}, 0});
      EXPECT_GT(arrival_us, 1'500'000'000'000'000);  // the wall clock, not the log's
    });
  }
  Process player({BODYSCHEMA_LCM_LOGPLAYER, "-l", url_, log});
  ASSERT_TRUE(player.started());
  for (int i = 0; i < 200 && received.size() < sent.size(); ++i) link.handle(100);
  EXPECT_EQ(player.wait(), 0);
  EXPECT_EQ(received, sent);
  // The played log gives the observations that the log itself gives.
  const auto live = observations_of(received);
  EXPECT_GT(live.size(), 100u);
  EXPECT_EQ(live, observations_of(sent));
}

}  // namespace
}  // namespace bodyschema
