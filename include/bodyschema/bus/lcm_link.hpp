#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "bodyschema/bus/message_sink.hpp"

namespace lcm {
class LCM;
}

namespace bodyschema {

/// The network all programs use unless told otherwise. A time to live of zero keeps every packet on
/// this machine.
inline constexpr const char* kDefaultLcmUrl = "udpm://239.255.76.67:7667?ttl=0";

/// `-l/--lcm-url` when given and not empty, else LCM_DEFAULT_URL, else kDefaultLcmUrl.
[[nodiscard]] std::string resolve_lcm_url(const std::optional<std::string>& command_line);

class GuardedReceiver;

/// What came from others than a channel's own source, where only one is admitted.
struct RefusedSources {
  std::uint64_t messages = 0;
  std::string channel;  ///< of the newest
  std::string sender;   ///< of the newest: address and port
};

/// Messages that reached this machine and were given up before anyone saw them. Known only where one
/// source is admitted: LCM itself keeps no count that it would tell.
struct LostMessages {
  std::uint64_t queue = 0;       ///< too many waited: the oldest of that channel
  std::uint64_t incomplete = 0;  ///< a part of them never came; of any channel
  std::uint64_t too_large = 0;   ///< refused by the size they announced
};

/// A connection to LCM: publishes, and hands every message of the subscribed channels to one
/// function. publish() may be called from any thread; handle() from one.
class LcmLink : public MessageSink {
 public:
  /// @param arrival_us  when the message reached this machine, microseconds since the Unix epoch
  using Handler = std::function<void(const std::string& channel, Bytes message, std::int64_t arrival_us)>;

  /// Throws DeviceError naming the URL and what to do when the network cannot be used.
  /// @param one_source_silence_s  when given, each channel is taken from one source only (a process,
  ///   by address and port): the first one heard, until it is silent for longer than this
  /// @param longest_message_bytes  longer ones are refused and counted, where one source only is admitted
  explicit LcmLink(std::string url, std::optional<double> one_source_silence_s = {},
                   std::size_t longest_message_bytes = 32u << 20);
  ~LcmLink() override;
  LcmLink(const LcmLink&) = delete;
  LcmLink& operator=(const LcmLink&) = delete;

  /// @param channel  a name, not a pattern
  /// @param queue_messages  messages that may wait between two calls of handle()
  /// An exception of the handler is caught and logged. Throws DeviceError when LCM refuses, which it
  /// does when no multicast packet comes back to it.
  void subscribe(const std::string& channel, int queue_messages, Handler handler);
  /// Waits for a message and hands it out; false when none came in time.
  bool handle(int timeout_ms);

  void publish(const std::string& channel, Microseconds time_us, Bytes message) override;

  [[nodiscard]] const std::string& url() const { return url_; }
  /// None where every source is admitted. Any thread.
  [[nodiscard]] RefusedSources refused_sources() const;
  /// Any thread.
  [[nodiscard]] LostMessages lost() const;

 private:
  struct Subscriber;
  std::string url_;
  std::unique_ptr<lcm::LCM> lcm_;
  std::vector<std::unique_ptr<Subscriber>> subscribers_;
  std::unique_ptr<GuardedReceiver> guarded_;  ///< receives instead of LCM, where it is there
};

}  // namespace bodyschema
