#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <string>
#include <string_view>

namespace bodyschema {

/// FNV-1a, 64 bit: names what it has read, protects nothing.
class Digest {
 public:
  Digest& add(const void* data, std::size_t bytes) {
    const auto* byte = static_cast<const unsigned char*>(data);
    for (std::size_t i = 0; i < bytes; ++i) add_word(byte[i]);
    return *this;
  }
  Digest& add(std::string_view text) { return add(text.data(), text.size()); }
  /// Eight bytes at once: another digest than of the bytes one by one, in an eighth of the time.
  void add_word(std::uint64_t word) { value_ = (value_ ^ word) * 0x100000001b3ull; }

  [[nodiscard]] std::uint64_t value() const { return value_; }
  /// 16 hexadecimal digits.
  [[nodiscard]] std::string text() const {
    char digits[17];
    std::snprintf(digits, sizeof digits, "%016llx", static_cast<unsigned long long>(value_));
    return digits;
  }

 private:
  std::uint64_t value_ = 0xcbf29ce484222325ull;
};

}  // namespace bodyschema
