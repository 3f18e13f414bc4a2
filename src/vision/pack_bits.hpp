#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace bodyschema {

static_assert(std::endian::native == std::endian::little, "pack_bits reads eight bytes at once");

/// Packs bytes of 0 or 1 into bits; `bytes` is readable, and zero, up to a whole word.
inline void pack_bits(const std::uint8_t* bytes, std::size_t count, std::uint64_t* words) {
  for (std::size_t u = 0; u < count; u += 64) {
    std::uint64_t word = 0;
    for (std::size_t k = 0; k < 8; ++k) {
      std::uint64_t eight = 0;
      std::memcpy(&eight, bytes + u + 8 * k, sizeof eight);
      // Bit b of the top byte gathers byte b.
      word |= ((eight * 0x0102040810204080u) >> 56) << (8 * k);
    }
    *words++ = word;
  }
}

}  // namespace bodyschema
