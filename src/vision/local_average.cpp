#include "local_average.hpp"

#include <algorithm>
#include <array>
#include <bit>

namespace bodyschema {

/// Of one row: sums over `2 radius + 1` pixels of it that lie in the box and not beside the robot.
void LocalAverage::sum_along_row(const Image& image, int v, const PixelBox& box, const PixelBox& strip, int radius,
                                 int* out) const {
  const auto channels = static_cast<std::size_t>(image.channels);
  const auto columns = static_cast<std::size_t>(strip.width());
  std::array<int, kMostPlanes> running{};
  const auto accumulate = [&](int u, int sign) {
    if (u < box.u0 || u > box.u1 || beside_.at(u, v)) return;
    const auto* pixel = image.pixel(u, v);
    for (std::size_t c = 0; c < channels; ++c) {
      running[c] += sign * pixel[c];
      running[channels] += sign * pixel[c] * pixel[c];
    }
    running[channels + 1] += sign;
  };
  for (int u = strip.u0 - radius; u < strip.u0 + radius; ++u) accumulate(u, 1);
  for (int u = strip.u0; u <= strip.u1; ++u, ++out) {
    accumulate(u + radius, 1);
    for (std::size_t c = 0; c < channels + 2; ++c) out[c * columns] = running[c];
    accumulate(u - radius, -1);
  }
}

void LocalAverage::average_strip(const Image& image, const BinaryMask& wanted, const PixelBox& box,
                                 const PixelBox& strip, int radius, BackgroundModel& local) {
  const auto channels = static_cast<std::size_t>(image.channels);
  const auto columns = static_cast<std::size_t>(strip.width());
  const std::size_t row_size = (channels + 2) * columns;
  const int kept = 2 * radius + 1;
  rows_.resize(static_cast<std::size_t>(kept) * row_size);
  columns_.assign(row_size, 0);
  const auto row_of = [&](int v) { return rows_.data() + static_cast<std::size_t>((v + kept) % kept) * row_size; };
  for (int v = strip.v0 - radius; v <= strip.v1 + radius; ++v) {
    if (const int gone = v - kept; gone >= std::max(strip.v0 - radius, box.v0)) {
      const int* row = row_of(v);
      for (std::size_t k = 0; k < row_size; ++k) columns_[k] -= row[k];
    }
    if (v >= box.v0 && v <= box.v1) {
      int* row = row_of(v);
      sum_along_row(image, v, box, strip, radius, row);
      for (std::size_t k = 0; k < row_size; ++k) columns_[k] += row[k];
    }
    const int middle = v - radius;
    if (middle < strip.v0) continue;
    const int word = strip.u0 >> 6;
    for (std::uint64_t bits = wanted.row(middle)[word]; bits != 0; bits &= bits - 1) {
      const int u = 64 * word + std::countr_zero(bits);
      if (u < strip.u0 || u > strip.u1) continue;
      const int* sum = columns_.data() + (u - strip.u0);
      const auto i =
          static_cast<std::size_t>(middle) * static_cast<std::size_t>(image.width) + static_cast<std::size_t>(u);
      const auto weight = static_cast<float>(sum[(channels + 1) * columns]);
      if (weight < 1.0f || local.precision[i] > 0.0f) continue;
      float squares = static_cast<float>(sum[channels * columns]) / weight;
      for (std::size_t c = 0; c < channels; ++c) {
        const float mean = static_cast<float>(sum[c * columns]) / weight;
        local.mean[i * channels + c] = mean;
        squares -= mean * mean;
      }
      // A varied background is no more certain than it is varied.
      local.precision[i] =
          1.0f / (std::max(squares, 0.0f) / static_cast<float>(channels) + local.noise_sd * local.noise_sd);
    }
  }
}

void LocalAverage::around(const Image& image, const BinaryMask& robot, const BinaryMask& wanted, const PixelBox& box,
                          int beside_px, int radius, BackgroundModel& local) {
  beside_ = robot;
  morphology_.dilate(beside_, beside_px);
  // In strips of one word's pixels, and of these only the rows about what is wanted.
  for (int word = box.u0 >> 6; word <= box.u1 >> 6; ++word) {
    PixelBox strip{std::max(64 * word, box.u0), 0, std::min(64 * word + 63, box.u1), 0};
    for (int v = box.v0; v <= box.v1; ++v) {
      if (wanted.row(v)[word] == 0) continue;
      strip.v0 = strip.v1 = v;
      for (; v <= std::min(strip.v1 + 2 * radius, box.v1); ++v) {
        if (wanted.row(v)[word] != 0) strip.v1 = v;
      }
      average_strip(image, wanted, box, strip, radius, local);
      --v;
    }
  }
}

}  // namespace bodyschema
