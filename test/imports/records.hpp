#pragma once

#include <cstring>
#include <string>
#include <vector>

#include "bodyschema/imports/record_stream.hpp"

namespace bodyschema {

/// Bytes in memory as a source, written record by record as import/framing.py does.
class RecordedBytes : public ByteSource {
 public:
  void add(const std::string& header, const std::vector<std::uint8_t>& payload = {}) {
    add_size(header.size());
    add_size(payload.size());
    bytes.insert(bytes.end(), header.begin(), header.end());
    bytes.insert(bytes.end(), payload.begin(), payload.end());
  }
  static std::vector<std::uint8_t> numbers(const std::vector<double>& values) {
    std::vector<std::uint8_t> payload(values.size() * sizeof(double));
    std::memcpy(payload.data(), values.data(), payload.size());
    return payload;
  }
  std::size_t read(std::span<std::uint8_t> into) override {
    const std::size_t count = std::min(into.size(), bytes.size() - at_);
    std::copy_n(bytes.begin() + static_cast<std::ptrdiff_t>(at_), count, into.begin());
    at_ += count;
    return count;
  }
  std::vector<std::uint8_t> bytes;

 private:
  void add_size(std::size_t size) {
    for (int shift = 0; shift < 32; shift += 8) bytes.push_back(static_cast<std::uint8_t>(size >> shift));
  }
  std::size_t at_ = 0;
};

}  // namespace bodyschema
