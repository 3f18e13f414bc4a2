#pragma once

#include <bit>
#include <concepts>
#include <cstdint>
#include <string>
#include <vector>

#include "bodyschema/bus/messages.hpp"

namespace bodyschema {

/// Reads LCM's wire format (big-endian, strings with length and terminating zero) with a check
/// before every step. After the first fault it stays failed: further reads return zeros, so that a
/// decoder is a plain list of fields and one look at result() at its end.
class WireReader {
 public:
  WireReader(Bytes bytes, const DecodeLimits& limits) : bytes_(bytes), limits_(limits) {}

  void fingerprint(std::int64_t expected);

  template <class Integer>
  requires std::integral<Integer> Integer integer() {
    using Unsigned = std::make_unsigned_t<Integer>;
    if (!need(sizeof(Integer))) return 0;
    Unsigned value = 0;
    for (std::size_t i = 0; i < sizeof(Integer); ++i) {
      value = static_cast<Unsigned>((static_cast<std::uint64_t>(value) << 8) | bytes_[position_ + i]);
    }
    position_ += sizeof(Integer);
    return static_cast<Integer>(value);
  }
  float float32() { return std::bit_cast<float>(integer<std::uint32_t>()); }
  double float64() { return std::bit_cast<double>(integer<std::uint64_t>()); }

  /// A time stamp after 1970 and before 2255, or zero.
  Microseconds stamp(const char* field);
  /// A count of items, of which each takes at least `min_item_bytes` of what is left.
  template <class Integer>
  Integer count(const char* field, int max, std::size_t min_item_bytes) {
    const auto n = integer<Integer>();
    return check_count(field, n, max, min_item_bytes) ? n : Integer{0};
  }
  void text(const char* field, std::string& out);
  void texts(const char* field, std::vector<std::string>& out, int n);
  void doubles(std::vector<double>& out, int n);
  /// The next n bytes, without copying.
  Bytes raw(std::size_t n);

  void fail(MessageFault fault, std::string detail);
  [[nodiscard]] bool ok() const { return result_.ok(); }
  /// The verdict, after a check that nothing is left over.
  DecodeResult finish();
  [[nodiscard]] const DecodeLimits& limits() const { return limits_; }

 private:
  bool need(std::size_t n);
  bool check_count(const char* field, std::int64_t n, int max, std::size_t min_item_bytes);

  Bytes bytes_;
  const DecodeLimits& limits_;
  std::size_t position_ = 0;
  DecodeResult result_;
};

}  // namespace bodyschema
