#include "guarded_receiver.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <spdlog/spdlog.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>

#include "bodyschema/core/clock.hpp"
#include "bodyschema/core/error.hpp"

namespace bodyschema {
namespace {

constexpr std::size_t kLargestPacket = 65'536;
constexpr int kPoll_ms = 50;
constexpr std::int64_t kQuietTime_us = 5'000'000;

/// Group and port of "udpm://group:port?...", as LCM reads it.
sockaddr_in group_of(const std::string& url) {
  static constexpr std::string_view kScheme = "udpm://";
  if (!url.starts_with(kScheme)) {
    throw DeviceError("bus.one_source needs LCM over UDP multicast (udpm://), not '" + url + "'");
  }
  const std::string place = url.substr(kScheme.size(), url.find('?') - kScheme.size());
  const auto colon = place.find(':');
  const std::string host = place.substr(0, colon);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  const int port = colon == std::string::npos ? 7667 : std::atoi(place.c_str() + colon + 1);
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  if (inet_pton(AF_INET, host.empty() ? "239.255.76.67" : host.c_str(), &address.sin_addr) != 1) {
    throw DeviceError("LCM cannot use '" + url + "': '" + host + "' is no IPv4 address");
  }
  return address;
}

int receive_buffer_of(const std::string& url) {
  const auto at = url.find("recv_buf_size=");
  return at == std::string::npos ? 0 : std::atoi(url.c_str() + at + std::strlen("recv_buf_size="));
}

void say_failure(const std::exception& failure) noexcept {
  try {
    spdlog::error("a packet could not be taken in: {}", failure.what());
  } catch (...) {  // no memory for that either
  }
}

}  // namespace

GuardedReceiver::GuardedReceiver(const std::string& lcm_url, std::int64_t silence_us, std::size_t longest_message_bytes)
    : longest_message_bytes_(longest_message_bytes), owners_(silence_us) {
  sockaddr_in group = group_of(lcm_url);
  socket_ = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const int yes = 1;
  const int bytes = receive_buffer_of(lcm_url);
  ip_mreq membership{};
  membership.imr_multiaddr = group.sin_addr;
  membership.imr_interface.s_addr = htonl(INADDR_ANY);
  const bool ok = socket_ >= 0 && setsockopt(socket_, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes) == 0 &&
                  setsockopt(socket_, SOL_SOCKET, SO_REUSEPORT, &yes, sizeof yes) == 0 &&
                  (bytes <= 0 || setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &bytes, sizeof bytes) == 0) &&
                  // Bound to the group, so that packets sent to this machine alone stay out.
                  bind(socket_, reinterpret_cast<const sockaddr*>(&group), sizeof group) == 0 &&
                  setsockopt(socket_, IPPROTO_IP, IP_ADD_MEMBERSHIP, &membership, sizeof membership) == 0;
  if (!ok) {
    const std::string why = std::strerror(errno);
    if (socket_ >= 0) close(socket_);
    throw DeviceError("the multicast group of '" + lcm_url + "' cannot be joined: " + why);
  }
  thread_ = std::thread([this] { work(); });
}

GuardedReceiver::~GuardedReceiver() {
  stopping_ = true;
  thread_.join();
  close(socket_);
}

void GuardedReceiver::subscribe(const std::string& channel, int queue_messages, LcmLink::Handler handler) {
  const std::lock_guard lock(mutex_);
  subscriptions_[channel] = {static_cast<std::size_t>(std::max(1, queue_messages)), 0, std::move(handler)};
}

void GuardedReceiver::work() {
  UdpmAssembler assembler({.message_bytes = longest_message_bytes_, .pending_bytes = 2 * longest_message_bytes_},
                          [this](const std::string& channel, Sender sender) { return wanted(channel, sender); });
  std::vector<std::uint8_t> packet(kLargestPacket);
  std::uint64_t failed = 0;
  std::int64_t said_us = -kQuietTime_us;
  while (!stopping_) {
    pollfd ready{socket_, POLLIN, 0};
    if (poll(&ready, 1, kPoll_ms) <= 0) continue;
    sockaddr_in from{};
    socklen_t length = sizeof from;
    const ssize_t bytes =
        recvfrom(socket_, packet.data(), packet.size(), MSG_DONTWAIT, reinterpret_cast<sockaddr*>(&from), &length);
    if (bytes <= 0) continue;
    try {
      auto message = assembler.take(Bytes(packet.data(), static_cast<std::size_t>(bytes)),
                                    {ntohl(from.sin_addr.s_addr), ntohs(from.sin_port)});
      if (message) take(std::move(*message));
    } catch (const std::exception& e) {  // of this packet, which cost its message; memory may be there for the next
      if (failed++ % 1000 == 0) say_failure(e);
    }
    bool refused = false;
    {
      const std::lock_guard lock(mutex_);
      refused = assembler.too_large() > lost_.too_large;
      lost_.incomplete = assembler.incomplete() + failed;
      lost_.too_large = assembler.too_large();
    }
    if (refused && monotonic_us() - said_us >= kQuietTime_us) {
      said_us = monotonic_us();
      spdlog::warn(
          "messages longer than {} MB refused: what bus.max_width_px and max_height_px ask for, 256 MiB at most",
          longest_message_bytes_ / 1'000'000);
    }
  }
}

/// Whether a long message that has told its channel shall be put together. It makes no owner: that is who has
/// spoken, not who has begun to.
bool GuardedReceiver::wanted(const std::string& channel, const Sender& sender) {
  std::string complaint;
  {
    const std::lock_guard lock(mutex_);
    if (!subscriptions_.contains(channel)) return false;
    const std::int64_t now_us = monotonic_us();
    if (owners_.would_admit(channel, sender, now_us)) return true;
    complaint = refuse(channel, sender, now_us);
  }
  if (!complaint.empty()) spdlog::warn("{}", complaint);
  return false;
}

void GuardedReceiver::take(UdpmAssembler::Message message) {
  const std::int64_t now = wall_us();
  std::string complaint;  // written without the lock, which the disk must not hold
  {
    const std::lock_guard lock(mutex_);
    const auto at = subscriptions_.find(message.channel);
    if (at == subscriptions_.end()) return;
    const std::int64_t heard_us = monotonic_us();
    if (owners_.admit(message.channel, message.sender, heard_us)) {
      enqueue(at->second, std::move(message), now);
    } else {
      complaint = refuse(message.channel, message.sender, heard_us);
    }
  }
  if (!complaint.empty()) {
    spdlog::warn("{}", complaint);
  } else {
    arrived_.notify_one();
  }
}

/// Counts, and answers what is to be said of it, if anything is now. Needs mutex_.
std::string GuardedReceiver::refuse(const std::string& channel, const Sender& sender, std::int64_t now_us) {
  ++refused_.messages;
  refused_.channel = channel;
  refused_.sender = sender.text();
  if (complained_us_ >= 0 && now_us - complained_us_ < kQuietTime_us) return {};
  complained_us_ = now_us;
  return channel + ": messages of " + refused_.sender + " refused, the channel is " + owners_.owner(channel)->text() +
         "'s";
}

/// Needs mutex_.
void GuardedReceiver::enqueue(Subscription& subscription, UdpmAssembler::Message message, std::int64_t wall_us) {
  if (subscription.waiting >= subscription.capacity) {
    const auto oldest = std::find_if(queue_.begin(), queue_.end(),
                                     [&](const Arrived& waiting) { return waiting.channel == message.channel; });
    queue_.erase(oldest);
    --subscription.waiting;
    ++lost_.queue;
  }
  ++subscription.waiting;
  queue_.push_back({std::move(message.channel), std::move(message.bytes), wall_us});
}

bool GuardedReceiver::handle(int timeout_ms) {
  Arrived arrived;
  LcmLink::Handler* handler = nullptr;
  {
    std::unique_lock lock(mutex_);
    if (!arrived_.wait_for(lock, std::chrono::milliseconds(timeout_ms), [this] { return !queue_.empty(); })) {
      return false;
    }
    arrived = std::move(queue_.front());
    queue_.pop_front();
    Subscription& subscription = subscriptions_.at(arrived.channel);
    --subscription.waiting;
    handler = &subscription.handler;  // of a map: stays where it is
  }
  try {
    (*handler)(arrived.channel, arrived.bytes, arrived.wall_us);
  } catch (const std::exception& e) {
    spdlog::error("{}: message could not be handled: {}", arrived.channel, e.what());
  }
  return true;
}

LostMessages GuardedReceiver::lost() const {
  const std::lock_guard lock(mutex_);
  return lost_;
}

RefusedSources GuardedReceiver::refused() const {
  const std::lock_guard lock(mutex_);
  return refused_;
}

}  // namespace bodyschema
