#pragma once

#include <sys/types.h>

#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <filesystem>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "bodyschema/bus/lcm_link.hpp"
#include "bodyschema/bus/log.hpp"
#include "bodyschema/bus/messages.hpp"
#include "own_port.hpp"

/// Starts the built programs, talks to them over LCM, and waits for what they say.
namespace bodyschema::integration {

using Seconds = std::chrono::duration<double>;

/// How many times as long everything may take: BODYSCHEMA_TEST_PATIENCE, for builds with sanitizers. Limits given to
/// this file's functions are of a release build.
double patience();

/// A program started by the test; killed when the test is done with it.
class Process {
 public:
  /// @param arguments  program first: a name in build/bin, or one on the path
  /// @param environment  added to this process's
  Process(std::vector<std::string> arguments, const std::filesystem::path& scratch,
          const std::map<std::string, std::string>& environment = {});
  ~Process();
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  void signal(int number) const;
  /// Exit status, 128 + signal when killed; nothing when it still runs after `limit`.
  std::optional<int> wait(Seconds limit);
  [[nodiscard]] bool running();
  [[nodiscard]] std::string out() const;
  [[nodiscard]] std::string err() const;
  /// Whether `words` were written to standard error in time.
  [[nodiscard]] bool said(const std::string& words, Seconds limit);
  [[nodiscard]] pid_t pid() const { return pid_; }

 private:
  std::filesystem::path out_, err_;
  pid_t pid_ = -1;
  std::optional<int> status_;
};

/// How long a process was ready to run but had no processor, by the kernel's own account
/// (/proc/PID/task/*/schedstat): what tells a busy machine from a service that is at fault.
class ProcessorWait {
 public:
  explicit ProcessorWait(pid_t pid) : pid_(pid), begin_s_(waited_s()) {}
  /// Since construction, as a share of the time that passed; of all threads together. 0: not known.
  [[nodiscard]] double share() const;

 private:
  [[nodiscard]] double waited_s() const;
  pid_t pid_;
  double begin_s_;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

/// A folder of the test's own, removed at its end unless the test failed.
class Scratch {
 public:
  Scratch();
  ~Scratch();
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  [[nodiscard]] std::filesystem::path operator/(const std::string& name) const { return folder_ / name; }
  [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }

 private:
  std::filesystem::path folder_;
};

/// Why LCM cannot be used here; empty when it can.
std::string why_no_lcm();

/// Everything that is published on the service's channels, as it comes.
class Listener {
 public:
  explicit Listener(const std::string& lcm_url);
  ~Listener();
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;

  [[nodiscard]] std::vector<joint_offsets_t> offsets() const;
  [[nodiscard]] std::vector<offsets_status_t> statuses() const;
  [[nodiscard]] std::vector<findings_t> findings() const;
  /// The estimates since the last call, for tests too long to keep them all.
  [[nodiscard]] std::vector<joint_offsets_t> take_offsets();
  /// The first status, among those that arrive from now on, that `wanted` accepts.
  std::optional<offsets_status_t> wait_status(const std::function<bool(const offsets_status_t&)>& wanted,
                                              Seconds limit);
  bool wait_offsets(std::size_t count, Seconds limit);

 private:
  LcmLink link_;
  mutable std::mutex mutex_;
  std::condition_variable arrived_;
  std::vector<joint_offsets_t> offsets_;
  std::vector<offsets_status_t> statuses_;
  std::vector<findings_t> findings_;
  std::jthread thread_;
};

/// A counter of a status; a failure where there is none of this name.
std::int64_t counter(const offsets_status_t& status, const std::string& name);
/// The sum of those whose names begin so.
std::int64_t counters_with(const offsets_status_t& status, const std::string& prefix);
/// Of the last status: pictures, one of each camera a frame, used in frames that were neither estimated nor shed, did
/// not fail and were not left. Zero, if the service counts right.
std::int64_t pictures_unaccounted_for(const offsets_status_t& status);

/// Plays a log in real time (or faster), from a thread of its own. `change` sees every message
/// before it goes out and may alter it, drop it (false), or publish more through the link.
class Player {
 public:
  using Change = std::function<bool(LogEvent& event, LcmLink& link)>;
  Player(const std::string& lcm_url, std::filesystem::path log, double speed = 1.0, Change change = {});
  ~Player();
  Player(const Player&) = delete;
  Player& operator=(const Player&) = delete;
  void wait();

 private:
  void work(const std::stop_token& stop);
  LcmLink link_;
  std::filesystem::path log_;
  double speed_;
  Change change_;
  std::jthread thread_;
};

/// A robot that never ends: a log played forwards, then backwards, and so on, so that the arm moves
/// without a jump for as long as a test needs. Stamps rise steadily.
class Robot {
 public:
  /// Each may alter a message or keep it from going out (false), or publish more through the link.
  struct Faults {
    std::function<bool(bot_core::images_t&, LcmLink&)> pictures;
    std::function<bool(bot_core::joint_state_t&, LcmLink&)> joints;
  };
  /// @param speed  times real time; @param every  of so many picture messages one goes out
  Robot(const std::string& lcm_url, const std::filesystem::path& log, double speed = 1.0, std::size_t every = 1);
  ~Robot();
  Robot(const Robot&) = delete;
  Robot& operator=(const Robot&) = delete;

  /// Takes effect from the next message on; {} heals.
  void set_faults(Faults faults);
  /// Nothing goes out any more.
  void stop();
  /// Messages that went out, those of faults included.
  [[nodiscard]] std::int64_t sent() const { return link_.sent; }

 private:
  struct Message {
    Microseconds time_us = 0;
    std::optional<bot_core::images_t> pictures;
    std::optional<bot_core::joint_state_t> joints;
  };
  void work(const std::stop_token& stop);
  void publish(const Message& message, bool forwards, Microseconds lap_begin);

  struct CountingLink : LcmLink {
    using LcmLink::LcmLink;
    void publish(const std::string& channel, Microseconds time_us, Bytes message) override {
      ++sent;
      LcmLink::publish(channel, time_us, message);
    }
    std::atomic<std::int64_t> sent{0};
  };
  CountingLink link_;
  double speed_;
  std::vector<Message> messages_;
  Microseconds first_us_ = 0, length_us_ = 0;
  /// When each message is due after a lap's begin, forwards and backwards: (due, index).
  std::array<std::vector<std::pair<Microseconds, std::size_t>>, 2> orders_;
  std::mutex mutex_;
  Faults faults_;
  std::jthread thread_;
};

/// A reach of our own simulated robot, made once per build folder: stereo at 30 Hz, encoders at
/// 100 Hz, empty frames first for the background.
std::filesystem::path reach_log();
/// What was true in it (the simulator's --truth).
std::filesystem::path reach_truth();
/// The configuration that goes with it.
std::string reach_configuration();

/// Lines of estimates.jsonl by utime.
std::map<Microseconds, std::string> estimates_by_utime(const std::filesystem::path& file);
/// Runs `bodyschema replay` and returns its estimates.
std::map<Microseconds, std::string> replay_estimates(const std::filesystem::path& log, const std::filesystem::path& out,
                                                     const std::vector<std::string>& more = {});

}  // namespace bodyschema::integration
