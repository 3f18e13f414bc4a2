#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace bodyschema::test {

/// Whether the client closes its side once it has sent its request.
enum class Afterwards { kListen, kHangUp };

/// Sends bytes as they are to a port of this machine and returns everything that comes back, until the
/// other side closes or says nothing for `patience`: a client that may misbehave.
inline std::string talk(int port, std::string_view request,
                        std::chrono::milliseconds patience = std::chrono::seconds(5),
                        Afterwards afterwards = Afterwards::kListen) {
  const int descriptor = socket(AF_INET, SOCK_STREAM, 0);
  const timeval limit{patience.count() / 1000, patience.count() % 1000 * 1000};
  setsockopt(descriptor, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  std::string answer;
  if (connect(descriptor, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) {
    (void)!send(descriptor, request.data(), request.size(), MSG_NOSIGNAL);
    if (afterwards == Afterwards::kHangUp) shutdown(descriptor, SHUT_WR);
    std::vector<char> text(65536);
    for (ssize_t n = 0; (n = recv(descriptor, text.data(), text.size(), 0)) > 0;) {
      answer.append(text.data(), static_cast<std::size_t>(n));
    }
  }
  close(descriptor);
  return answer;
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
