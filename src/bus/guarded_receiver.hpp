#pragma once

#include <atomic>
#include <condition_variable>
#include <deque>
#include <map>
#include <mutex>
#include <string>
#include <thread>

#include "bodyschema/bus/lcm_link.hpp"
#include "bodyschema/bus/udpm_assembler.hpp"

namespace bodyschema {

/// Receives LCM's UDP multicast packets on a socket of its own, because LCM's interface does not say
/// who sent a message, and takes each channel's messages from one source only (ChannelOwners).
/// A thread reads packets; handle() runs the handlers.
class GuardedReceiver {
 public:
  /// @param lcm_url  udpm://
  /// @param longest_message_bytes  unfinished messages of all senders take twice this at most
  /// Throws DeviceError when the URL is another or the group cannot be joined.
  GuardedReceiver(const std::string& lcm_url, std::int64_t silence_us, std::size_t longest_message_bytes);
  ~GuardedReceiver();
  GuardedReceiver(const GuardedReceiver&) = delete;
  GuardedReceiver& operator=(const GuardedReceiver&) = delete;

  void subscribe(const std::string& channel, int queue_messages, LcmLink::Handler handler);
  /// As LcmLink::handle().
  bool handle(int timeout_ms);
  [[nodiscard]] RefusedSources refused() const;
  [[nodiscard]] LostMessages lost() const;

 private:
  struct Arrived {
    std::string channel;
    std::vector<std::uint8_t> bytes;
    std::int64_t wall_us = 0;
  };
  struct Subscription {
    std::size_t capacity = 0;
    std::size_t waiting = 0;
    LcmLink::Handler handler;
  };
  void work();
  bool wanted(const std::string& channel, const Sender& sender);
  void take(UdpmAssembler::Message message);
  std::string refuse(const std::string& channel, const Sender& sender, std::int64_t now_us);
  void enqueue(Subscription& subscription, UdpmAssembler::Message message, std::int64_t wall_us);

  int socket_ = -1;
  const std::size_t longest_message_bytes_;
  std::atomic<bool> stopping_{false};
  mutable std::mutex mutex_;
  std::condition_variable arrived_;
  std::map<std::string, Subscription> subscriptions_;
  std::deque<Arrived> queue_;
  ChannelOwners owners_;
  RefusedSources refused_;
  LostMessages lost_;
  std::int64_t complained_us_ = -1;  ///< monotonic_us() of the last line about a second source
  std::thread thread_;
};

}  // namespace bodyschema
