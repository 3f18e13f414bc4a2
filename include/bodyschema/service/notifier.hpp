#pragma once

#include <cstdint>
#include <string>

namespace bodyschema {

/// Tells systemd how the service is doing, by sd_notify's protocol: one datagram per message to the
/// socket named by $NOTIFY_SOCKET. Without that variable every call does nothing, so the program
/// works the same without systemd. status() may be called from another thread than the rest; throws
/// nothing.
class Notifier {
 public:
  /// Reads $NOTIFY_SOCKET, $WATCHDOG_USEC and $WATCHDOG_PID.
  Notifier();
  ~Notifier();
  Notifier(const Notifier&) = delete;
  Notifier& operator=(const Notifier&) = delete;

  void ready();
  /// What `systemctl status` shows; sent when it changes.
  void status(const std::string& sentence);
  void reloading();
  void stopping();
  /// Feeds the watchdog, no more often than it needs. To be called from the loop it watches.
  void alive();

  /// Microseconds after which a silent service is killed; 0: there is no watchdog.
  [[nodiscard]] std::int64_t watchdog_us() const { return watchdog_us_; }

 private:
  void send(const std::string& text) const;
  int socket_ = -1;
  std::string address_;
  std::int64_t watchdog_us_ = 0;
  std::int64_t last_alive_us_ = 0;
  std::string last_status_;
};

}  // namespace bodyschema
