#pragma once

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstddef>
#include <cstring>
#include <stdexcept>
#include <string>

namespace bodyschema {

/// A port, of UDP and TCP, that no other test of this machine gets while this process lives. LCM's sockets share a
/// port, and a program that is to listen on it needs it free, so a port cannot be locked by binding it; a socket of the
/// abstract name of the port is its lock, and goes with the process.
inline int own_port() {
  constexpr int kFirst = 20'000, kPorts = 12'000;  // below those that the kernel gives away
  static int next = getpid() * 7 % kPorts;
  for (int tries = 0; tries < kPorts; ++tries) {
    const int port = kFirst + next;
    next = (next + 1) % kPorts;
    sockaddr_un lock{};
    lock.sun_family = AF_UNIX;
    const std::string name = "bodyschema-test-port-" + std::to_string(port);
    std::memcpy(lock.sun_path + 1, name.data(), name.size());  // its first byte is zero: no file
    const int descriptor = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + name.size());
    if (descriptor >= 0 && bind(descriptor, reinterpret_cast<const sockaddr*>(&lock), size) == 0) return port;
    close(descriptor);
  }
  throw std::runtime_error("no port is free for a test");
}

/// A network of this test's own: packets stay on this machine.
inline std::string own_lcm_url() {
  return "udpm://239.255.76.67:" + std::to_string(own_port()) + "?ttl=0";
}

}  // namespace bodyschema
