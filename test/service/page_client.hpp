#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace bodyschema::test {

/// Whether the client closes its side once it has sent its request.
enum class Afterwards { kListen, kHangUp };

/// A client's socket, connected to a port of this machine or not, as is_open() tells. Neither sending
/// nor receiving waits longer than `patience`.
class PageClient {
 public:
  explicit PageClient(int port, std::chrono::milliseconds patience = std::chrono::seconds(5),
                      in_addr_t address = htonl(INADDR_LOOPBACK))
      : descriptor_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    const timeval limit{patience.count() / 1000, patience.count() % 1000 * 1000};
    setsockopt(descriptor_, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
    setsockopt(descriptor_, SOL_SOCKET, SO_SNDTIMEO, &limit, sizeof limit);
    sockaddr_in there{};
    there.sin_family = AF_INET;
    there.sin_port = htons(static_cast<std::uint16_t>(port));
    there.sin_addr.s_addr = address;
    open_ = connect(descriptor_, reinterpret_cast<const sockaddr*>(&there), sizeof there) == 0;
  }
  ~PageClient() {
    if (descriptor_ >= 0) close(descriptor_);
  }
  PageClient(PageClient&& other) noexcept
      : descriptor_(std::exchange(other.descriptor_, -1)), open_(std::exchange(other.open_, false)) {}
  PageClient& operator=(PageClient&&) = delete;

  [[nodiscard]] bool is_open() const { return open_; }
  /// Whether the other side took them all.
  bool send(std::string_view bytes) {
    return ::send(descriptor_, bytes.data(), bytes.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(bytes.size());
  }
  void hang_up() { shutdown(descriptor_, SHUT_WR); }
  /// Everything that comes back, until the other side closes or says nothing for `patience`.
  std::string receive() {
    std::string answer;
    std::vector<char> text(65536);
    for (ssize_t n = 0; (n = recv(descriptor_, text.data(), text.size(), 0)) > 0;) {
      answer.append(text.data(), static_cast<std::size_t>(n));
    }
    return answer;
  }

 private:
  int descriptor_;
  bool open_ = false;
};

/// Sends bytes as they are and returns everything that comes back: a client that may misbehave.
inline std::string talk(int port, std::string_view request,
                        std::chrono::milliseconds patience = std::chrono::seconds(5),
                        Afterwards afterwards = Afterwards::kListen) {
  PageClient client(port, patience);
  if (!client.is_open()) return {};
  client.send(request);
  if (afterwards == Afterwards::kHangUp) client.hang_up();
  return client.receive();
}

/// The answer, header and body, to a request for a page.
inline std::string get(int port, const std::string& path, const std::string& host = "localhost") {
  return talk(port, "GET " + path + " HTTP/1.1\r\nHost: " + host + "\r\nConnection: close\r\n\r\n");
}

inline std::string body(const std::string& answer) {
  const auto end = answer.find("\r\n\r\n");
  return end == std::string::npos ? "" : answer.substr(end + 4);
}

}  // namespace bodyschema::test
