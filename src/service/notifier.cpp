#include "bodyschema/service/notifier.hpp"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <cstdlib>
#include <cstring>

#include "bodyschema/core/clock.hpp"

namespace bodyschema {

namespace {
std::string environment(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? "" : value;
}
}  // namespace

Notifier::Notifier() : address_(environment("NOTIFY_SOCKET")) {
  const bool usable =
      (address_.starts_with('/') || address_.starts_with('@')) && address_.size() < sizeof(sockaddr_un::sun_path);
  if (!usable) return;
  socket_ = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  const std::string pid = environment("WATCHDOG_PID");
  if (pid.empty() || pid == std::to_string(getpid())) {
    watchdog_us_ = std::strtoll(environment("WATCHDOG_USEC").c_str(), nullptr, 10);
  }
}

Notifier::~Notifier() {
  if (socket_ >= 0) close(socket_);
}

void Notifier::send(const std::string& text) const {
  if (socket_ < 0) return;
  sockaddr_un to{};
  to.sun_family = AF_UNIX;
  std::memcpy(to.sun_path, address_.data(), address_.size());
  if (address_.front() == '@') to.sun_path[0] = '\0';  // a name in the abstract name space
  const auto length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + address_.size());
  // A manager that does not listen must not stop the robot: whatever goes wrong here is ignored.
  while (sendto(socket_, text.data(), text.size(), MSG_NOSIGNAL, reinterpret_cast<const sockaddr*>(&to), length) < 0 &&
         errno == EINTR) {
  }
}

void Notifier::ready() {
  send("READY=1");
}

void Notifier::status(const std::string& sentence) {
  if (sentence == last_status_) return;
  last_status_ = sentence;
  send("STATUS=" + sentence);
}

void Notifier::reloading() {
  send("RELOADING=1\nMONOTONIC_USEC=" + std::to_string(monotonic_us()));
}

void Notifier::stopping() {
  send("STOPPING=1\nSTATUS=stopping");
}

void Notifier::alive() {
  if (watchdog_us_ <= 0) return;
  const std::int64_t now = monotonic_us();
  if (last_alive_us_ != 0 && now - last_alive_us_ < watchdog_us_ / 4) return;
  last_alive_us_ = now;
  send("WATCHDOG=1");
}

}  // namespace bodyschema
