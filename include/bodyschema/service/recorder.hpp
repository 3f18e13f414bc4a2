#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "bodyschema/bus/log.hpp"

namespace bodyschema {

/// Records messages to a log from a thread of its own, so that a slow disk holds up nobody. What
/// waits for the disk is bounded; beyond it, and once the disk has failed, messages are lost and
/// counted. One for which nothing waits is taken whatever its size. Any thread may record.
class Recorder {
 public:
  static constexpr std::size_t kWaiting_bytes = 64u << 20;

  /// Throws FileError when the log cannot be created.
  /// @param max_waiting_bytes  what may wait for the disk, beside the message being written
  explicit Recorder(const std::filesystem::path& file, std::size_t max_waiting_bytes = kWaiting_bytes);
  ~Recorder();  ///< writes what waits
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  void record(const std::string& channel, Microseconds time_us, Bytes message);
  /// Pictures may have another size after a reload. What waits already is kept.
  void set_room(std::size_t max_waiting_bytes);

  struct State {
    std::uint64_t written = 0;
    std::uint64_t lost = 0;
    std::string failure;  ///< why writing ended; empty while all is well
  };
  [[nodiscard]] State state() const;

 private:
  struct Message {
    std::string channel;
    Microseconds time_us;
    std::vector<std::uint8_t> data;
  };
  void work();

  LogWriter writer_;
  mutable std::mutex mutex_;
  std::size_t max_waiting_bytes_;
  std::condition_variable filled_;
  std::deque<Message> waiting_;
  std::size_t waiting_bytes_ = 0;
  State state_;
  bool closing_ = false;
  std::thread thread_;  ///< last: starts when all else is there
};

}  // namespace bodyschema
