#pragma once

#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace bodyschema {

/// A bit image, one bit per pixel. Rows are padded to whole 64-bit words; pixel u of a row is bit
/// u % 64 of word u / 64; padding bits are always zero (count() relies on it).
class BinaryMask {
 public:
  BinaryMask() = default;
  BinaryMask(int width, int height)
      : width_(width), height_(height), words_per_row_((width + 63) / 64),
        words_(static_cast<std::size_t>(words_per_row_) * static_cast<std::size_t>(height), 0) {}

  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
  [[nodiscard]] int words_per_row() const { return words_per_row_; }
  [[nodiscard]] bool empty() const { return words_.empty(); }
  [[nodiscard]] std::size_t bytes() const { return words_.size() * sizeof(std::uint64_t); }

  [[nodiscard]] bool at(int u, int v) const { return (row(v)[u >> 6] >> (u & 63)) & 1u; }
  /// Of the pixel nearest to a place in the picture; outside: false.
  [[nodiscard]] bool shows(double u, double v) const {
    const long column = std::lround(u), row = std::lround(v);
    return column >= 0 && row >= 0 && column < width_ && row < height_ &&
           at(static_cast<int>(column), static_cast<int>(row));
  }
  void set(int u, int v, bool value = true) {
    const std::uint64_t bit = std::uint64_t{1} << (u & 63);
    auto& word = row(v)[u >> 6];
    word = value ? (word | bit) : (word & ~bit);
  }
  void fill(bool value) {
    for (int v = 0; v < height_; ++v) {
      for (int w = 0; w < words_per_row_; ++w) row(v)[w] = value ? ~std::uint64_t{0} : 0;
      if (value && (width_ & 63) != 0) {
        row(v)[words_per_row_ - 1] = (std::uint64_t{1} << (width_ & 63)) - 1;
      }
    }
  }

  [[nodiscard]] const std::uint64_t* row(int v) const {
    return words_.data() + static_cast<std::size_t>(v) * static_cast<std::size_t>(words_per_row_);
  }
  [[nodiscard]] std::uint64_t* row(int v) {
    return words_.data() + static_cast<std::size_t>(v) * static_cast<std::size_t>(words_per_row_);
  }

  [[nodiscard]] std::size_t count() const {
    std::size_t n = 0;
    for (const auto word : words_) n += static_cast<std::size_t>(std::popcount(word));
    return n;
  }
  // Of two pictures of one size, pixel by pixel: what is in both, in either, in the first alone.
  BinaryMask& operator&=(const BinaryMask& other) {
    for (std::size_t i = 0; i < words_.size(); ++i) words_[i] &= other.words_[i];
    return *this;
  }
  BinaryMask& operator|=(const BinaryMask& other) {
    for (std::size_t i = 0; i < words_.size(); ++i) words_[i] |= other.words_[i];
    return *this;
  }
  BinaryMask& operator-=(const BinaryMask& other) {
    for (std::size_t i = 0; i < words_.size(); ++i) words_[i] &= ~other.words_[i];
    return *this;
  }
  friend bool operator==(const BinaryMask&, const BinaryMask&) = default;

 private:
  int width_ = 0;
  int height_ = 0;
  int words_per_row_ = 0;
  std::vector<std::uint64_t> words_;
};

/// Takes pixels out of those that count; an empty `valid` is all of them, empty `pixels` are none.
inline void leave_out(const BinaryMask& pixels, BinaryMask& valid) {
  if (pixels.empty()) return;
  if (valid.empty()) {
    valid = BinaryMask(pixels.width(), pixels.height());
    valid.fill(true);
  }
  valid -= pixels;
}

}  // namespace bodyschema
