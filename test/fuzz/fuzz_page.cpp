// Requests to the live page, as raw bytes on its socket. The page must answer a good request after.
#include <arpa/inet.h>
#include <sys/socket.h>

#include <cstdio>
#include <cstdlib>

#include "bodyschema/service/live_page.hpp"
#include "fuzz.hpp"

using namespace bodyschema;

namespace {

/// Sends bytes, reads what comes back until the other side is done.
std::string ask(int port, std::string_view request) {
  const int s = socket(AF_INET, SOCK_STREAM, 0);
  const timeval limit{0, 300000};
  setsockopt(s, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  std::string answer;
  if (connect(s, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0) {
    (void)!send(s, request.data(), request.size(), MSG_NOSIGNAL);
    shutdown(s, SHUT_WR);
    char buffer[4096];
    for (ssize_t n = 0; answer.size() < 65536 && (n = recv(s, buffer, sizeof buffer, 0)) > 0;) {
      answer.append(buffer, static_cast<std::size_t>(n));
    }
  }
  close(s);
  return answer;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static LivePage page(0, {"left", "right"});
  ask(page.port(), fuzz::as_text(data, size));
  static int count = 0;
  if (++count % 100 == 0 &&
      ask(page.port(), "GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n\r\n").find("200 OK") ==
          std::string::npos) {
    std::fputs("the page no longer answers\n", stderr);
    std::abort();
  }
  return 0;
}
