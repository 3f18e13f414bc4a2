#include "bodyschema/service/notifier.hpp"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <string>

namespace bodyschema {
namespace {

/// The manager's end of $NOTIFY_SOCKET.
class Manager {
 public:
  /// @param name  a path, or "@..." for the abstract name space
  explicit Manager(const std::string& name) : name_(name) {
    socket_ = socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK, 0);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::memcpy(address.sun_path, name.data(), name.size());
    if (name.front() == '@') address.sun_path[0] = '\0';
    const auto length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + name.size());
    EXPECT_EQ(bind(socket_, reinterpret_cast<const sockaddr*>(&address), length), 0) << std::strerror(errno);
    setenv("NOTIFY_SOCKET", name.c_str(), 1);
  }
  ~Manager() {
    close(socket_);
    if (name_.front() == '/') unlink(name_.c_str());
    for (const char* variable : {"NOTIFY_SOCKET", "WATCHDOG_USEC", "WATCHDOG_PID"}) unsetenv(variable);
  }
  /// The next message; empty when there is none.
  std::string next() const {
    char text[4096];
    const ssize_t n = recv(socket_, text, sizeof text, 0);
    return n > 0 ? std::string(text, static_cast<std::size_t>(n)) : "";
  }

 private:
  std::string name_;
  int socket_;
};

std::string abstract_name() {
  return "@bodyschema-test-" + std::to_string(getpid());
}

TEST(Notifier, SpeaksTheProtocol) {
  const Manager manager(abstract_name());
  Notifier notifier;
  notifier.ready();
  EXPECT_EQ(manager.next(), "READY=1");
  notifier.status("OK: converged");
  notifier.status("OK: converged");  // unchanged: not sent again
  EXPECT_EQ(manager.next(), "STATUS=OK: converged");
  EXPECT_EQ(manager.next(), "");
  notifier.reloading();
  EXPECT_EQ(manager.next().rfind("RELOADING=1\nMONOTONIC_USEC=", 0), 0u);
  notifier.stopping();
  EXPECT_EQ(manager.next().rfind("STOPPING=1", 0), 0u);
  notifier.alive();
  EXPECT_EQ(manager.next(), "") << "no watchdog was asked for";
}

TEST(Notifier, FeedsTheWatchdogNoMoreThanNeeded) {
  const Manager manager(abstract_name());
  setenv("WATCHDOG_USEC", "200000", 1);
  Notifier notifier;
  EXPECT_EQ(notifier.watchdog_us(), 200'000);
  notifier.alive();
  notifier.alive();
  EXPECT_EQ(manager.next(), "WATCHDOG=1");
  EXPECT_EQ(manager.next(), "");
  usleep(60'000);
  notifier.alive();
  EXPECT_EQ(manager.next(), "WATCHDOG=1");
}

TEST(Notifier, IgnoresAnotherProcessesWatchdog) {
  const Manager manager(abstract_name());
  setenv("WATCHDOG_USEC", "200000", 1);
  setenv("WATCHDOG_PID", "1", 1);
  EXPECT_EQ(Notifier().watchdog_us(), 0);
}

TEST(Notifier, PathSocket) {
  const Manager manager("/tmp/bodyschema-test-" + std::to_string(getpid()) + ".sock");
  Notifier notifier;
  notifier.ready();
  EXPECT_EQ(manager.next(), "READY=1");
}

TEST(Notifier, WithoutSystemdOrWithAnAbsurdSocketNothingHappens) {
  unsetenv("NOTIFY_SOCKET");
  Notifier().ready();
  setenv("NOTIFY_SOCKET", std::string(5000, '/').c_str(), 1);
  Notifier().ready();
  setenv("NOTIFY_SOCKET", "/nowhere/at/all", 1);
  Notifier().ready();
  unsetenv("NOTIFY_SOCKET");
}

}  // namespace
}  // namespace bodyschema
