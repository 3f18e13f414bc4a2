#include "local_average.hpp"

#include <algorithm>

namespace bodyschema {

void LocalAverage::around(const Image& image, const BinaryMask& robot, const PixelBox& box, int radius,
                          BackgroundModel& local) {
  const auto channels = static_cast<std::size_t>(image.channels);
  const auto columns = static_cast<std::size_t>(box.width());
  const auto rows = static_cast<std::size_t>(box.height());
  const std::size_t planes = channels + 2;  // colours, their squares, the number of pixels
  beside_ = robot;
  morphology_.dilate(beside_, 2);
  for (std::size_t c = 0; c < planes; ++c) sums_[c].resize(columns * rows);
  for (int v = box.v0; v <= box.v1; ++v) {
    std::array<int, 5> running{};
    const auto accumulate = [&](int u, int sign) {
      if (u < box.u0 || u > box.u1 || beside_.at(u, v)) return;
      const auto* pixel = image.pixel(u, v);
      for (std::size_t c = 0; c < channels; ++c) {
        running[c] += sign * pixel[c];
        running[channels] += sign * pixel[c] * pixel[c];
      }
      running[channels + 1] += sign;
    };
    auto index = static_cast<std::size_t>(v - box.v0) * columns;
    for (int u = box.u0; u < box.u0 + radius; ++u) accumulate(u, 1);
    for (int u = box.u0; u <= box.u1; ++u, ++index) {
      accumulate(u + radius, 1);
      for (std::size_t c = 0; c < planes; ++c) sums_[c][index] = running[c];
      accumulate(u - radius, -1);
    }
  }
  columns_.assign(planes * columns, 0);
  const auto add_row = [&](int v, int sign) {
    if (v < box.v0 || v > box.v1) return;
    for (std::size_t c = 0; c < planes; ++c) {
      const int* row = sums_[c].data() + static_cast<std::size_t>(v - box.v0) * columns;
      int* column = columns_.data() + c * columns;
      for (std::size_t u = 0; u < columns; ++u) column[u] += sign * row[u];
    }
  };
  for (int v = box.v0; v < box.v0 + radius; ++v) add_row(v, 1);
  for (int v = box.v0; v <= box.v1; ++v) {
    add_row(v + radius, 1);
    for (std::size_t u = 0; u < columns; ++u) {
      const auto i =
          static_cast<std::size_t>(v) * static_cast<std::size_t>(image.width) + static_cast<std::size_t>(box.u0) + u;
      const auto weight = static_cast<float>(columns_[(channels + 1) * columns + u]);
      if (weight < 1.0f || local.precision[i] > 0.0f) continue;
      float squares = static_cast<float>(columns_[channels * columns + u]) / weight;
      for (std::size_t c = 0; c < channels; ++c) {
        const float mean = static_cast<float>(columns_[c * columns + u]) / weight;
        local.mean[i * channels + c] = mean;
        squares -= mean * mean;
      }
      // A varied background is no more certain than it is varied.
      local.precision[i] =
          1.0f / (std::max(squares, 0.0f) / static_cast<float>(channels) + local.noise_sd * local.noise_sd);
    }
    add_row(v - radius, -1);
  }
}

}  // namespace bodyschema
