#pragma once

#include <cstddef>
#include <vector>

namespace bodyschema {

/// What every pixel looks like without the robot, and how far noise carries it from there.
///
/// Row order, levels of 0 to 255.
struct BackgroundModel {
  int width = 0;
  int height = 0;
  int channels = 0;
  std::vector<float> mean;  ///< channels interleaved, as in Image
  /// 1 / variance of one channel, levels^-2, the mean's own uncertainty included; 0: unknown pixel.
  std::vector<float> precision;
  /// Typical standard deviation of the noise of one channel, levels.
  float noise_sd = 0.0f;

  BackgroundModel() = default;
  BackgroundModel(int w, int h, int c) : width(w), height(h), channels(c) {
    const auto n = static_cast<std::size_t>(w) * static_cast<std::size_t>(h);
    mean.assign(n * static_cast<std::size_t>(c), 0.0f);
    precision.assign(n, 0.0f);
  }
  [[nodiscard]] std::size_t pixels() const { return precision.size(); }
};

/// The noise of an 8-bit camera is never taken to be below its rounding.
inline constexpr float kLeastNoiseSd = 0.4f;

}  // namespace bodyschema
