#pragma once

#include <string>

#include "bodyschema/bus/messages.hpp"

namespace bodyschema {

/// Where messages go: the network, a log file, or a test's list. Whoever publishes writes against
/// this, so that it runs without a network as well.
class MessageSink {
 public:
  virtual ~MessageSink() = default;
  /// @param time_us  when the message is sent; a log stores it, the network ignores it.
  virtual void publish(const std::string& channel, Microseconds time_us, Bytes message) = 0;

  template <class Message>
  void publish_message(const std::string& channel, Microseconds time_us, const Message& message) {
    publish(channel, time_us, encode(message));
  }
};

}  // namespace bodyschema
