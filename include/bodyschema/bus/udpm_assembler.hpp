#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
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
/// at a time from each sender. Memory is taken for what has arrived, not for what is announced, and is
/// bounded whatever arrives: message size, senders, and what is begun and not finished. Where room is
/// short, messages whose channel is not known yet go first, and of those alike the largest: a sender
/// cannot drive out one that asks for less. One thread; throws nothing but bad_alloc.
/// Source: LCM UDP multicast protocol description, lcm-proj.github.io.
class UdpmAssembler {
 public:
  struct Limits {
    std::size_t message_bytes = 32u << 20;  ///< longer messages are refused, and counted where they are wanted
    std::size_t pending_bytes = 64u << 20;  ///< of all unfinished messages, as far as they have arrived
    std::size_t senders = 64;               ///< with an unfinished message
  };
  /// Whether messages of this sender on this channel are wanted; asked once a long one tells its channel.
  using Wanted = std::function<bool(const std::string& channel, Sender sender)>;
  UdpmAssembler() : UdpmAssembler(Limits{}) {}
  explicit UdpmAssembler(const Limits& limits, Wanted wanted = {}) : limits_(limits), wanted_(std::move(wanted)) {}

  struct Message {
    std::string channel;
    std::vector<std::uint8_t> bytes;
    Sender sender;
  };
  /// The message that this packet completes, if it does. What is not LCM's is ignored.
  std::optional<Message> take(Bytes packet, Sender sender);

  /// Messages begun and given up: a fragment was lost, they were not what they said, or there were too many
  /// at a time. Not those that were not wanted.
  [[nodiscard]] std::uint64_t incomplete() const { return incomplete_; }
  /// Messages longer than `message_bytes` that were wanted.
  [[nodiscard]] std::uint64_t too_large() const { return too_large_; }
  /// What unfinished messages hold now.
  [[nodiscard]] std::size_t pending_bytes() const { return pending_bytes_; }

 private:
  struct Piece {
    std::size_t offset = 0;
    std::vector<std::uint8_t> bytes;
  };
  struct Pending {
    std::uint32_t sequence = 0;
    std::size_t size = 0;
    std::size_t fragments = 0;
    std::map<std::size_t, Piece> pieces;  ///< by fragment
    std::size_t arrived = 0;              ///< bytes of all pieces
    std::optional<std::string> channel;
    bool unwanted = false;  ///< kept without pieces, so that the rest of it is known for what it is
    std::uint64_t begun = 0;
    [[nodiscard]] std::size_t memory() const;
    /// What goes last where room is short.
    [[nodiscard]] int rank() const { return unwanted ? 0 : channel ? 2 : 1; }
  };
  using Place = std::map<Sender, Pending>::iterator;
  std::optional<Message> take_fragment(Bytes packet, Sender sender);
  void refuse(std::uint32_t sequence, const std::string& channel, Sender sender);
  void remove(Place pending);
  void give_up(Place pending);
  bool make_room(Place newcomer);

  Limits limits_;
  Wanted wanted_;
  std::map<Sender, Pending> pending_;
  std::size_t pending_bytes_ = 0;
  std::uint64_t order_ = 0;
  std::uint64_t incomplete_ = 0;
  std::uint64_t too_large_ = 0;
  std::optional<std::pair<Sender, std::uint32_t>> refused_;  ///< the last one too large: whose, and its sequence
};

/// Who may speak on a channel: whoever spoke first, until silent for longer than `silence_us`.
class ChannelOwners {
 public:
  explicit ChannelOwners(std::int64_t silence_us) : silence_us_(silence_us) {}

  /// @param now_us  a clock that never steps back
  bool admit(const std::string& channel, Sender sender, std::int64_t now_us);
  /// What admit() would answer.
  [[nodiscard]] bool would_admit(const std::string& channel, Sender sender, std::int64_t now_us) const;
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
