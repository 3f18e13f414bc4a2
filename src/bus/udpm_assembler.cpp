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
  const auto end = std::find(rest.begin(), rest.begin() + static_cast<std::ptrdiff_t>(std::min(rest.size(), kMaxChannel + 1)),
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
  if (size > limits_.message_bytes || fragments == 0 || fragment >= fragments) return std::nullopt;
  std::optional<std::string> channel;
  if (fragment == 0 && !(channel = take_channel(rest))) return std::nullopt;
  if (offset > size || rest.size() > size - offset) return std::nullopt;

  auto at = pending_.find(sender);
  if (at != pending_.end() && (at->second.sequence != sequence || at->second.bytes.size() != size ||
                               at->second.here.size() != fragments)) {
    // A sender's numbers rise (and wrap): what comes late belongs to a message given up before.
    if (static_cast<std::int32_t>(sequence - at->second.sequence) < 0) return std::nullopt;
    give_up(at);
    at = pending_.end();
  }
  if (at == pending_.end()) {
    make_room(size);
    Pending begun;
    begun.sequence = sequence;
    begun.bytes.resize(size);
    begun.here.resize(fragments);
    begun.missing = fragments;
    begun.begun = order_++;
    pending_bytes_ += size;
    at = pending_.emplace(sender, std::move(begun)).first;
  }
  Pending& pending = at->second;
  if (pending.here[fragment]) return std::nullopt;
  pending.here[fragment] = true;
  --pending.missing;
  std::copy(rest.begin(), rest.end(), pending.bytes.begin() + static_cast<std::ptrdiff_t>(offset));
  if (channel) pending.channel = std::move(channel);
  if (pending.missing > 0) return std::nullopt;
  Message message{std::move(*pending.channel), std::move(pending.bytes), sender};
  pending_bytes_ -= size;
  pending_.erase(at);
  return message;
}

void UdpmAssembler::give_up(std::map<Sender, Pending>::iterator pending) {
  ++incomplete_;
  pending_bytes_ -= pending->second.bytes.size();
  pending_.erase(pending);
}

void UdpmAssembler::make_room(std::size_t bytes) {
  while (!pending_.empty() &&
         (pending_.size() >= limits_.senders || pending_bytes_ + bytes > limits_.pending_bytes)) {
    give_up(std::min_element(pending_.begin(), pending_.end(),
                             [](const auto& a, const auto& b) { return a.second.begun < b.second.begun; }));
  }
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

std::optional<Sender> ChannelOwners::owner(const std::string& channel) const {
  const auto at = owners_.find(channel);
  if (at == owners_.end()) return std::nullopt;
  return at->second.sender;
}

}  // namespace bodyschema
