#include "bodyschema/bus/udpm_assembler.hpp"

#include <algorithm>
#include <cstring>

namespace bodyschema {
namespace {

constexpr std::uint32_t kShortMagic = 0x4c433032;     // "LC02"
constexpr std::uint32_t kFragmentMagic = 0x4c433033;  // "LC03"
constexpr std::size_t kShortHeader = 8;
constexpr std::size_t kFragmentHeader = 20;
constexpr std::size_t kMaxChannel = 63;

std::uint32_t u32(Bytes packet, std::size_t at) {
  return static_cast<std::uint32_t>(packet[at]) << 24 | static_cast<std::uint32_t>(packet[at + 1]) << 16 |
         static_cast<std::uint32_t>(packet[at + 2]) << 8 | packet[at + 3];
}

std::uint32_t u16(Bytes packet, std::size_t at) {
  return static_cast<std::uint32_t>(packet[at]) << 8 | packet[at + 1];
}

/// Cuts the channel's name and its NUL off the front.
std::optional<std::string> take_channel(Bytes& rest) {
  const auto end =
      std::find(rest.begin(), rest.begin() + static_cast<std::ptrdiff_t>(std::min(rest.size(), kMaxChannel + 1)),
                std::uint8_t{0});
  const auto length = static_cast<std::size_t>(end - rest.begin());
  if (length > kMaxChannel || length >= rest.size()) return std::nullopt;
  std::string channel(rest.begin(), end);
  rest = rest.subspan(length + 1);
  return channel;
}

}  // namespace

std::string Sender::text() const {
  std::string text;
  for (int shift = 24; shift >= 0; shift -= 8) {
    text += std::to_string((address >> shift) & 255u) + (shift > 0 ? "." : ":");
  }
  return text + std::to_string(port);
}

std::optional<UdpmAssembler::Message> UdpmAssembler::take(Bytes packet, Sender sender) {
  if (packet.size() < kShortHeader) return std::nullopt;
  const std::uint32_t magic = u32(packet, 0);
  if (magic == kFragmentMagic) return take_fragment(packet, sender);
  if (magic != kShortMagic) return std::nullopt;
  Bytes rest = packet.subspan(kShortHeader);
  auto channel = take_channel(rest);
  if (!channel) return std::nullopt;
  return Message{std::move(*channel), {rest.begin(), rest.end()}, sender};
}

std::optional<UdpmAssembler::Message> UdpmAssembler::take_fragment(Bytes packet, Sender sender) {
  if (packet.size() < kFragmentHeader) return std::nullopt;
  const std::uint32_t sequence = u32(packet, 4);
  const std::size_t size = u32(packet, 8);
  const std::size_t offset = u32(packet, 12);
  const std::size_t fragment = u16(packet, 16);
  const std::size_t fragments = u16(packet, 18);
  Bytes rest = packet.subspan(kFragmentHeader);
  if (fragments == 0 || fragment >= fragments) return std::nullopt;
  std::optional<std::string> channel;
  if (fragment == 0 && !(channel = take_channel(rest))) return std::nullopt;
  if (size > limits_.message_bytes) {
    if (channel) refuse(sequence, *channel, sender);
    return std::nullopt;
  }
  if (offset > size || rest.size() > size - offset) return std::nullopt;

  auto at = pending_.find(sender);
  if (at != pending_.end() &&
      (at->second.sequence != sequence || at->second.size != size || at->second.fragments != fragments)) {
    // A sender's numbers rise (and wrap): what comes late belongs to a message given up before.
    if (static_cast<std::int32_t>(sequence - at->second.sequence) < 0) return std::nullopt;
    give_up(at);
    at = pending_.end();
  }
  if (at == pending_.end()) {
    at = pending_.emplace(sender, Pending{}).first;
    at->second.sequence = sequence;
    at->second.size = size;
    at->second.fragments = fragments;
    at->second.begun = order_++;
    pending_bytes_ += at->second.memory();
  }
  Pending& pending = at->second;
  if (pending.unwanted || pending.pieces.contains(fragment)) return std::nullopt;
  const bool unwanted = channel && wanted_ && !wanted_(*channel, sender);
  const std::size_t before = pending.memory();
  if (unwanted) {
    pending.unwanted = true;
    pending.pieces.clear();
    pending.arrived = 0;
  } else {
    pending.pieces.emplace(fragment, Piece{offset, {rest.begin(), rest.end()}});  // throws before anything changes
    pending.arrived += rest.size();
    if (channel) pending.channel = std::move(channel);
  }
  pending_bytes_ = pending_bytes_ - before + pending.memory();
  if (!make_room(at) || pending.unwanted || pending.pieces.size() < fragments) return std::nullopt;
  if (pending.arrived != size) {  // or a packet that says it is all of a long message would take that memory
    give_up(at);
    return std::nullopt;
  }
  Message message{std::move(*pending.channel), std::vector<std::uint8_t>(size), sender};
  for (const auto& [unused, piece] : pending.pieces) {
    std::copy(piece.bytes.begin(), piece.bytes.end(),
              message.bytes.begin() + static_cast<std::ptrdiff_t>(piece.offset));
  }
  remove(at);
  return message;
}

/// A message that is too large is counted by the fragment that tells its channel; that may come twice.
void UdpmAssembler::refuse(std::uint32_t sequence, const std::string& channel, Sender sender) {
  if (refused_ == std::pair(sender, sequence)) return;
  refused_ = {sender, sequence};
  if (!wanted_ || wanted_(channel, sender)) ++too_large_;
}

/// With what the tables take, so that many small pieces are not free.
std::size_t UdpmAssembler::Pending::memory() const {
  constexpr std::size_t kEach = 128;
  return arrived + kEach * (1 + pieces.size());
}

void UdpmAssembler::remove(Place pending) {
  pending_bytes_ -= pending->second.memory();
  pending_.erase(pending);
}

void UdpmAssembler::give_up(Place pending) {
  if (!pending->second.unwanted) ++incomplete_;
  remove(pending);
}

/// False where the newcomer itself had to go.
bool UdpmAssembler::make_room(Place newcomer) {
  while (pending_.size() > limits_.senders || pending_bytes_ > limits_.pending_bytes) {
    const bool too_many = pending_.size() > limits_.senders;
    const auto victim = std::min_element(pending_.begin(), pending_.end(), [&](const auto& a, const auto& b) {
      const Pending &p = a.second, &q = b.second;
      if (p.rank() != q.rank()) return p.rank() < q.rank();
      if (!too_many && p.memory() != q.memory()) return p.memory() > q.memory();
      return p.begun < q.begun;
    });
    const bool itself = victim == newcomer;
    give_up(victim);
    if (itself) return false;
  }
  return true;
}

bool ChannelOwners::admit(const std::string& channel, Sender sender, std::int64_t now_us) {
  const auto [at, first] = owners_.try_emplace(channel, Owner{sender, now_us});
  Owner& owner = at->second;
  if (!first && owner.sender != sender) {
    if (now_us - owner.heard_us <= silence_us_) return false;
    owner.sender = sender;
  }
  owner.heard_us = now_us;
  return true;
}

bool ChannelOwners::would_admit(const std::string& channel, Sender sender, std::int64_t now_us) const {
  const auto at = owners_.find(channel);
  return at == owners_.end() || at->second.sender == sender || now_us - at->second.heard_us > silence_us_;
}

std::optional<Sender> ChannelOwners::owner(const std::string& channel) const {
  const auto at = owners_.find(channel);
  if (at == owners_.end()) return std::nullopt;
  return at->second.sender;
}

}  // namespace bodyschema
