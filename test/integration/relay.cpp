#include "relay.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <optional>
#include <stdexcept>
#include <vector>

namespace bodyschema::integration {
namespace {

constexpr int kBuffer_bytes = 8 << 20;

sockaddr_in group_of(const std::string& url) {
  const auto host = url.find("//") + 2;
  const auto colon = url.find(':', host);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(std::stoi(url.substr(colon + 1))));
  if (inet_pton(AF_INET, url.substr(host, colon - host).c_str(), &address.sin_addr) != 1) {
    throw std::runtime_error("no address in " + url);
  }
  return address;
}

}  // namespace

Relay::Relay(const std::string& from_lcm_url, const std::string& to_lcm_url, unsigned seed)
    : in_(socket(AF_INET, SOCK_DGRAM, 0)), out_(socket(AF_INET, SOCK_DGRAM, 0)), random_(seed) {
  const sockaddr_in from = group_of(from_lcm_url);
  const sockaddr_in to = group_of(to_lcm_url);
  const int yes = 1;
  const unsigned char here = 0;
  ip_mreq membership{};
  membership.imr_multiaddr = from.sin_addr;
  setsockopt(in_, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  setsockopt(in_, SOL_SOCKET, SO_RCVBUFFORCE, &kBuffer_bytes, sizeof kBuffer_bytes);
  setsockopt(in_, SOL_SOCKET, SO_RCVBUF, &kBuffer_bytes, sizeof kBuffer_bytes);
  setsockopt(out_, IPPROTO_IP, IP_MULTICAST_TTL, &here, sizeof here);
  if (bind(in_, reinterpret_cast<const sockaddr*>(&from), sizeof from) != 0 ||
      setsockopt(in_, IPPROTO_IP, IP_ADD_MEMBERSHIP, &membership, sizeof membership) != 0 ||
      connect(out_, reinterpret_cast<const sockaddr*>(&to), sizeof to) != 0) {
    throw std::runtime_error("the relay cannot use the network");
  }
  thread_ = std::jthread([this](const std::stop_token& stop) { work(stop); });
}

Relay::~Relay() {
  thread_.request_stop();
  thread_.join();
  close(in_);
  close(out_);
}

void Relay::set(double lost, double swapped) {
  lost_ = lost;
  swapped_ = swapped;
}

void Relay::work(const std::stop_token& stop) {
  std::uniform_real_distribution<double> uniform;
  std::vector<char> packet(65'536);
  std::optional<std::vector<char>> held;
  while (!stop.stop_requested()) {
    pollfd ready{in_, POLLIN, 0};
    if (poll(&ready, 1, 50) <= 0) continue;
    const ssize_t bytes = recv(in_, packet.data(), packet.size(), MSG_DONTWAIT);
    if (bytes <= 0) continue;
    ++packets_;
    const auto end = packet.begin() + bytes;
    if (uniform(random_) < lost_) {
      ++lost_count_;
    } else if (!held && uniform(random_) < swapped_) {
      ++swapped_count_;
      held.emplace(packet.begin(), end);
    } else {
      (void)!send(out_, packet.data(), static_cast<std::size_t>(bytes), 0);
      if (held) (void)!send(out_, held->data(), held->size(), 0);
      held.reset();
    }
  }
}

}  // namespace bodyschema::integration
