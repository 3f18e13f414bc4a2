#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "bodyschema/bus/messages.hpp"

namespace bodyschema {

/// Who sent a packet: one LCM connection of one process.
struct Sender {
  std::uint32_t address = 0;  ///< IPv4, host byte order
  std::uint16_t port = 0;
  friend auto operator<=>(const Sender&, const Sender&) = default;
  /// "192.168.0.7:51234".
  [[nodiscard]] std::string text() const;
};

/// Packets of LCM's UDP multicast protocol to messages, with what LCM's own interface keeps back: who
/// sent them. Short messages are one packet; longer ones come in fragments, in any order, one message
/// at a time from each sender. Memory is bounded whatever arrives: message size, senders, and what is
/// begun and not finished. Pure computation; one thread; throws nothing but bad_alloc.
/// Source: LCM UDP multicast protocol description, lcm-proj.github.io.
class UdpmAssembler {
 public:
  struct Limits {
    std::size_t message_bytes = 32u << 20;  ///< longer messages are refused
    std::size_t pending_bytes = 64u << 20;  ///< of all unfinished messages; beyond, the oldest is given up
    std::size_t senders = 64;               ///< with an unfinished message
  };
  UdpmAssembler() : UdpmAssembler(Limits{}) {}
  explicit UdpmAssembler(const Limits& limits) : limits_(limits) {}

  struct Message {
    std::string channel;
    std::vector<std::uint8_t> bytes;
    Sender sender;
  };
  /// The message that this packet completes, if it does. What is not LCM's is ignored.
  std::optional<Message> take(Bytes packet, Sender sender);

  /// Messages begun and given up: a fragment was lost, or there were too many at a time.
  [[nodiscard]] std::uint64_t incomplete() const { return incomplete_; }

 private:
  struct Pending {
    std::uint32_t sequence = 0;
    std::vector<std::uint8_t> bytes;
    std::vector<bool> here;  ///< by fragment
    std::size_t missing = 0;
    std::optional<std::string> channel;
    std::uint64_t begun = 0;
  };
  std::optional<Message> take_fragment(Bytes packet, Sender sender);
  void give_up(std::map<Sender, Pending>::iterator pending);
  void make_room(std::size_t bytes);

  Limits limits_;
  std::map<Sender, Pending> pending_;
  std::size_t pending_bytes_ = 0;
  std::uint64_t order_ = 0;
  std::uint64_t incomplete_ = 0;
};

/// Who may speak on a channel: whoever spoke first, until silent for longer than `silence_us`.
class ChannelOwners {
 public:
  explicit ChannelOwners(std::int64_t silence_us) : silence_us_(silence_us) {}

  /// @param now_us  a clock that never steps back
  bool admit(const std::string& channel, Sender sender, std::int64_t now_us);
  /// Of the channel; nothing while nobody has spoken.
  [[nodiscard]] std::optional<Sender> owner(const std::string& channel) const;

 private:
  struct Owner {
    Sender sender;
    std::int64_t heard_us = 0;
  };
  std::int64_t silence_us_;
  std::map<std::string, Owner> owners_;
};

}  // namespace bodyschema
