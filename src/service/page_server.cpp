#include "page_server.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <optional>
#include <utility>

#include "bodyschema/core/clock.hpp"
#include "bodyschema/core/error.hpp"
#include "bodyschema/core/thread_priority.hpp"

namespace bodyschema {
namespace {

constexpr std::size_t kConnections = 32;
constexpr std::size_t kHeadBytes = 8192;
constexpr std::int64_t kHeadTime_us = 2'000'000;
constexpr std::int64_t kAnswerTime_us = 10'000'000;
constexpr std::int64_t kNoDescriptors_us = 200'000;  // between two attempts when the process has none left
constexpr int kNice = 19;                            // the least important, whatever the service itself was given

/// The page's own files and this origin's answers, nothing else; no other site may show or read them.
constexpr std::string_view kHeaders =
    "Connection: close\r\n"
    "Cache-Control: no-store\r\n"
    "X-Content-Type-Options: nosniff\r\n"
    "X-Frame-Options: DENY\r\n"
    "Referrer-Policy: no-referrer\r\n"
    "Cross-Origin-Resource-Policy: same-origin\r\n"
    "Content-Security-Policy: default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; "
    "img-src 'self' data: blob:; connect-src 'self'\r\n";

const char* reason(int status) {
  switch (status) {
    case 200: return "OK";
    case 400: return "Bad Request";
    case 403: return "Forbidden";
    case 404: return "Not Found";
    case 405: return "Method Not Allowed\r\nAllow: GET, HEAD";
    case 431: return "Request Header Fields Too Large";
    case 503: return "Service Unavailable";
    default: return "Internal Server Error";
  }
}

std::string to_http(const PageAnswer& answer, bool with_body = true) {
  std::string text = "HTTP/1.1 " + std::to_string(answer.status) + " " + reason(answer.status) + "\r\n";
  text += kHeaders;
  text += "Content-Type: " + std::string(answer.type) + "\r\n";
  text += "Content-Length: " + std::to_string(answer.body.size()) + "\r\n\r\n";
  if (with_body) text += answer.body;
  return text;
}

std::string refusal(int status, std::string why) {
  return to_http({status, "text/plain", std::move(why) + "\n"});
}

bool same_word(std::string_view a, std::string_view b) {
  const auto lower = [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; };
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [&](char x, char y) { return lower(x) == lower(y); });
}

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t");
  return first == std::string_view::npos ? "" : text.substr(first, text.find_last_not_of(" \t") + 1 - first);
}

/// Takes one line off the front of the text.
std::string_view next_line(std::string_view& text) {
  const auto end = text.find("\r\n");
  const std::string_view line = text.substr(0, end);
  text.remove_prefix(std::min(text.size(), line.size() + 2));
  return line;
}

/// The one Host of a request's header lines; nothing when there is none or more than one.
std::optional<std::string_view> host_of(std::string_view lines) {
  std::optional<std::string_view> host;
  while (!lines.empty()) {
    const std::string_view line = next_line(lines);
    const auto colon = line.find(':');
    if (colon == std::string_view::npos || !same_word(line.substr(0, colon), "Host")) continue;
    if (host) return std::nullopt;
    host = trimmed(line.substr(colon + 1));
  }
  return host;
}

/// A request that a browser was led into by a forged name (DNS rebinding) carries that name.
bool is_this_machine(std::string_view host) {
  if (const auto colon = host.rfind(':'); colon != std::string_view::npos && host.back() != ']') {
    host = host.substr(0, colon);
  }
  return host == "localhost" || host == "127.0.0.1" || host == "[::1]";
}

}  // namespace

PageServer::Descriptor::~Descriptor() {
  if (number_ >= 0) close(number_);
}
PageServer::Descriptor::Descriptor(Descriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
PageServer::Descriptor& PageServer::Descriptor::operator=(Descriptor&& other) noexcept {
  std::swap(number_, other.number_);
  return *this;
}

PageServer::PageServer(int port, Handler handler)
    : handler_(std::move(handler)), listener_(socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0)),
      stop_(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {
  const int yes = 1;
  setsockopt(listener_.get(), SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  if (bind(listener_.get(), reinterpret_cast<const sockaddr*>(&address), size) != 0 ||
      listen(listener_.get(), kConnections) != 0 ||
      getsockname(listener_.get(), reinterpret_cast<sockaddr*>(&address), &size) != 0) {
    throw DeviceError("the live page cannot have port " + std::to_string(port) + " on localhost; is it in use?");
  }
  port_ = ntohs(address.sin_port);
  connections_.reserve(kConnections);
  thread_ = std::thread([this] { serve(); });
}

PageServer::~PageServer() {
  eventfd_write(stop_.get(), 1);
  thread_.join();
}

void PageServer::serve() {
  give_way(kNice);  // pictures must not take time from the estimator
  std::vector<pollfd> polled;
  while (true) {
    const std::int64_t now = monotonic_us();
    const bool accepting = accept_again_us_ <= now;
    std::int64_t next_us = accepting ? now + kAnswerTime_us : accept_again_us_;
    polled.assign({{stop_.get(), POLLIN, 0}, {listener_.get(), static_cast<short>(accepting ? POLLIN : 0), 0}});
    for (const Connection& c : connections_) {
      polled.push_back({c.socket.get(), static_cast<short>(c.answer.empty() ? POLLIN : POLLOUT), 0});
      next_us = std::min(next_us, c.until_us);
    }
    const std::int64_t wait_us = std::max<std::int64_t>(0, next_us - now);
    poll(polled.data(), polled.size(), static_cast<int>(wait_us / 1000 + 1));
    if (polled[0].revents != 0) return;
    // From the back: what is done with is taken out.
    for (std::size_t i = connections_.size(); i-- > 0;) {
      if (polled[i + 2].revents == 0) continue;
      Connection& connection = connections_[i];
      if (!(connection.answer.empty() ? read(connection) : write(connection))) {
        connections_.erase(connections_.begin() + static_cast<std::ptrdiff_t>(i));
      }
    }
    // After their turn: what came in time counts, however late this thread could look.
    std::erase_if(connections_, [](const Connection& c) { return c.until_us <= monotonic_us(); });
    if (polled[1].revents != 0) accept_all();
  }
}

void PageServer::accept_all() {
  // As many as could wait, so that those that come in without end do not keep the others from their turn.
  for (std::size_t i = 0; i < kConnections; ++i) {
    Descriptor socket(accept4(listener_.get(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
    if (socket.get() < 0) {
      if (errno == EMFILE || errno == ENFILE || errno == ENOMEM || errno == ENOBUFS) {
        accept_again_us_ = monotonic_us() + kNoDescriptors_us;
      }
      return;
    }
    if (connections_.size() < kConnections) {
      connections_.push_back({std::move(socket), monotonic_us() + kHeadTime_us});
    } else {
      const std::string busy = refusal(503, "too many connections");
      (void)!send(socket.get(), busy.data(), busy.size(), MSG_NOSIGNAL);
    }
  }
}

bool PageServer::read(Connection& connection) const {
  std::array<char, kHeadBytes> bytes;
  const ssize_t count = recv(connection.socket.get(), bytes.data(), kHeadBytes - connection.head.size(), 0);
  if (count <= 0) return count < 0 && (errno == EAGAIN || errno == EINTR);
  connection.head.append(bytes.data(), static_cast<std::size_t>(count));
  if (const auto end = connection.head.find("\r\n\r\n"); end != std::string::npos) {
    connection.answer = answer_to(std::string_view(connection.head).substr(0, end));
  } else if (connection.head.size() == kHeadBytes) {
    connection.answer = refusal(431, "at most " + std::to_string(kHeadBytes) + " bytes of header expected");
  } else {
    return true;
  }
  connection.until_us = monotonic_us() + kAnswerTime_us;
  return write(connection);
}

bool PageServer::write(Connection& connection) {
  const std::string_view rest = std::string_view(connection.answer).substr(connection.sent);
  const ssize_t count = send(connection.socket.get(), rest.data(), rest.size(), MSG_NOSIGNAL);
  if (count < 0) return errno == EAGAIN || errno == EINTR;
  connection.sent += static_cast<std::size_t>(count);
  return connection.sent < connection.answer.size();
}

std::string PageServer::answer_to(std::string_view head) const {
  const std::string_view line = next_line(head);
  const auto first = line.find(' ');
  const auto last = line.rfind(' ');
  if (line.empty() || first == last || !line.substr(last + 1).starts_with("HTTP/1.") ||
      line.find_first_of(std::string_view("\r\n\0", 3)) != std::string_view::npos) {
    return refusal(400, "not a request");
  }
  const std::string_view method = line.substr(0, first);
  if (method != "GET" && method != "HEAD") return refusal(405, "only GET is answered");
  const auto host = host_of(head);
  if (!host || !is_this_machine(*host)) return refusal(403, "this page is for this machine only");
  const std::string_view target = line.substr(first + 1, last - first - 1);
  const auto question = std::min(target.find('?'), target.size());
  const PageRequest request{target.substr(0, question), target.substr(std::min(question + 1, target.size()))};
  try {
    return to_http(handler_(request), method == "GET");
  } catch (const std::exception&) {
    return refusal(500, "the page failed");
  }
}

}  // namespace bodyschema
