#include "bodyschema/bus/lcm_link.hpp"

#include <spdlog/spdlog.h>

#include <cerrno>
#include <cstdlib>
#include <lcm/lcm-cpp.hpp>

#include "bodyschema/core/error.hpp"
#include "guarded_receiver.hpp"

namespace bodyschema {

namespace {
std::string network_advice(const std::string& url) {
  return url.rfind("udpm", 0) == 0 ? "; is there a route for multicast? (ip link set lo multicast on; "
                                     "ip route add 224.0.0.0/4 dev lo)"
                                   : "";
}
}  // namespace

struct LcmLink::Subscriber {
  Handler handler;
  /// Called by C code: nothing may be thrown out of it. Not a member function: GCC 12 with
  /// -fsanitize=undefined calls LCM's pointer to one on a null object.
  static void receive(const lcm::ReceiveBuffer* buffer, const std::string& channel, Subscriber* self) {
    try {
      self->handler(channel, Bytes(static_cast<const std::uint8_t*>(buffer->data), buffer->data_size),
                    buffer->recv_utime);
    } catch (const std::exception& e) {
      spdlog::error("{}: message could not be handled: {}", channel, e.what());
    } catch (...) {
      spdlog::error("{}: message could not be handled", channel);
    }
  }
};

std::string resolve_lcm_url(const std::optional<std::string>& command_line) {
  if (command_line && !command_line->empty()) return *command_line;
  const char* from_environment = std::getenv("LCM_DEFAULT_URL");
  return from_environment != nullptr && *from_environment != '\0' ? from_environment : kDefaultLcmUrl;
}

LcmLink::LcmLink(std::string url, std::optional<double> one_source_silence_s, std::size_t longest_message_bytes)
    : url_(std::move(url)), lcm_(std::make_unique<lcm::LCM>(url_)) {
  if (!lcm_->good()) throw DeviceError("LCM cannot use '" + url_ + "'" + network_advice(url_));
  if (one_source_silence_s) {
    guarded_ = std::make_unique<GuardedReceiver>(url_, static_cast<std::int64_t>(1e6 * *one_source_silence_s),
                                                 longest_message_bytes);
  }
}

LcmLink::~LcmLink() = default;

void LcmLink::subscribe(const std::string& channel, int queue_messages, Handler handler) {
  if (guarded_) return guarded_->subscribe(channel, queue_messages, std::move(handler));
  auto subscriber = std::make_unique<Subscriber>(Subscriber{std::move(handler)});
  // LCM takes a pattern; ours are names of letters, digits, '_' and '-', which stand for themselves.
  lcm::Subscription* subscription = lcm_->subscribeFunction(channel, &Subscriber::receive, subscriber.get());
  if (subscription == nullptr) {
    throw DeviceError("LCM cannot receive on '" + url_ + "'" + network_advice(url_));
  }
  subscription->setQueueCapacity(queue_messages);
  subscribers_.push_back(std::move(subscriber));
}

RefusedSources LcmLink::refused_sources() const {
  return guarded_ ? guarded_->refused() : RefusedSources{};
}

LostMessages LcmLink::lost() const {
  return guarded_ ? guarded_->lost() : LostMessages{};
}

bool LcmLink::handle(int timeout_ms) {
  if (guarded_) return guarded_->handle(timeout_ms);
  errno = 0;
  const int result = lcm_->handleTimeout(timeout_ms);
  if (result < 0 && errno == EINTR) return false;  // a signal came, or the process was stopped for a while
  if (result < 0) throw DeviceError("LCM stopped receiving on '" + url_ + "'");
  return result > 0;
}

void LcmLink::publish(const std::string& channel, Microseconds /*time_us*/, Bytes message) {
  if (lcm_->publish(channel, message.data(), static_cast<unsigned int>(message.size())) != 0) {
    throw DeviceError("LCM cannot send on '" + url_ + "', channel " + channel);
  }
}

}  // namespace bodyschema
