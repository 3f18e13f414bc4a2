#include "bodyschema/core/picture_size.hpp"

#include <algorithm>
#include <array>
#include <cstddef>

namespace bodyschema {
namespace {

using Bytes = std::span<const std::uint8_t>;

constexpr std::array<std::uint8_t, 8> kPng = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};
constexpr std::uint64_t kMost = 1'000'000'000;

int big_endian(Bytes bytes, std::size_t at, std::size_t count) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < count && at + i < bytes.size(); ++i) value = value << 8 | bytes[at + i];
  return static_cast<int>(std::min(value, kMost));
}

/// Of the frame's header, which stands behind segments of known lengths.
PictureSize jpeg_size(Bytes bytes) {
  for (std::size_t at = 2; at + 9 < bytes.size();) {
    if (bytes[at] != 0xFF) return {};
    const std::uint8_t marker = bytes[at + 1];
    if (marker == 0xFF) {  // padding
      ++at;
      continue;
    }
    // Start of frame: C0 to CF but for tables (C4, CC) and an extension (C8).
    if (marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC) {
      return {big_endian(bytes, at + 7, 2), big_endian(bytes, at + 5, 2)};
    }
    at += 2 + static_cast<std::size_t>(big_endian(bytes, at + 2, 2));
  }
  return {};
}

/// Two numbers behind white space and comments.
PictureSize netpbm_size(Bytes bytes) {
  std::size_t at = 2;
  const auto number = [&]() -> int {
    const auto blank = [](std::uint8_t c) { return c == ' ' || (c >= '\t' && c <= '\r'); };
    while (at < bytes.size() && (blank(bytes[at]) || bytes[at] == '#')) {
      if (bytes[at++] != '#') continue;
      while (at < bytes.size() && bytes[at] != '\n' && bytes[at] != '\r') ++at;
    }
    std::uint64_t value = 0;
    for (; at < bytes.size() && bytes[at] >= '0' && bytes[at] <= '9'; ++at) {
      value = std::min<std::uint64_t>(10 * value + (bytes[at] - '0'), kMost);
    }
    return static_cast<int>(value);
  };
  const int width = number();
  return {width, number()};
}

}  // namespace

std::optional<PictureSize> picture_size(Bytes file) {
  if (file.size() >= kPng.size() && std::equal(kPng.begin(), kPng.end(), file.begin())) {
    return PictureSize{big_endian(file, 16, 4), big_endian(file, 20, 4)};
  }
  if (file.size() < 3) return std::nullopt;
  if (file[0] == 0xFF && file[1] == 0xD8) return jpeg_size(file);
  if (file[0] == 'P' && file[1] >= '1' && file[1] <= '6') return netpbm_size(file);
  return std::nullopt;
}

}  // namespace bodyschema
