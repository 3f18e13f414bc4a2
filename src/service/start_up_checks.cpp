#include "bodyschema/service/start_up_checks.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <spdlog/fmt/fmt.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <optional>

namespace bodyschema {
namespace {

constexpr int kWanted_bytes = 8 << 20;  // as config/service/60-bodyschema.conf allows
constexpr int kEnough_bytes = 2 << 20;  // four uncompressed colour pairs of 320x240

class UdpSocket {
 public:
  UdpSocket() : descriptor_(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {}
  ~UdpSocket() {
    if (descriptor_ >= 0) close(descriptor_);
  }
  UdpSocket(const UdpSocket&) = delete;
  UdpSocket& operator=(const UdpSocket&) = delete;
  [[nodiscard]] int descriptor() const { return descriptor_; }

 private:
  int descriptor_;
};

/// Group and port of "udpm://group:port?..."; nothing for other URLs.
std::optional<sockaddr_in> multicast_address(const std::string& url) {
  static constexpr std::string_view kScheme = "udpm://";
  if (!url.starts_with(kScheme)) return std::nullopt;
  const std::string place = url.substr(kScheme.size(), url.find('?') - kScheme.size());
  const std::string host = place.substr(0, place.find(':'));
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(7667);
  if (inet_pton(AF_INET, host.empty() ? "239.255.76.67" : host.c_str(), &address.sin_addr) != 1) return std::nullopt;
  return address;
}

}  // namespace

std::string with_receive_buffer(const std::string& lcm_url) {
  if (!lcm_url.starts_with("udpm://") || lcm_url.find("recv_buf_size=") != std::string::npos) return lcm_url;
  return lcm_url + (lcm_url.find('?') == std::string::npos ? '?' : '&') +
         "recv_buf_size=" + std::to_string(kWanted_bytes);
}

std::vector<std::string> check_network(const std::string& lcm_url) {
  std::vector<std::string> complaints;
  const auto address = multicast_address(lcm_url);
  if (!address) return complaints;
  const UdpSocket socket;
  if (socket.descriptor() < 0) return {fmt::format("no UDP socket can be had: {}", std::strerror(errno))};
  if (connect(socket.descriptor(), reinterpret_cast<const sockaddr*>(&*address), sizeof *address) != 0) {
    char text[INET_ADDRSTRLEN] = {};
    inet_ntop(AF_INET, &address->sin_addr, text, sizeof text);
    complaints.push_back(
        fmt::format("no multicast route to {}, so LCM programs cannot hear each other ({}); as root: "
                    "ip link set lo multicast on && ip route add 224.0.0.0/4 dev lo",
                    text, std::strerror(errno)));
  }
  int bytes = kWanted_bytes;
  setsockopt(socket.descriptor(), SOL_SOCKET, SO_RCVBUF, &bytes, sizeof bytes);
  socklen_t size = sizeof bytes;
  getsockopt(socket.descriptor(), SOL_SOCKET, SO_RCVBUF, &bytes, &size);
  bytes /= 2;  // Linux reports twice what it grants
  if (bytes < kEnough_bytes) {
    complaints.push_back(
        fmt::format("the receive buffer is limited to {} KiB, pictures may be lost without a word; as root: "
                    "sysctl -w net.core.rmem_max={}",
                    bytes / 1024, kWanted_bytes));
  }
  return complaints;
}

}  // namespace bodyschema
