#include "bodyschema/simulator/image_sensor.hpp"

#include <algorithm>
#include <cmath>

namespace bodyschema::simulator {
namespace {

/// Quantile of the standard normal by bisection on erfc: used 4096 times, at start.
double normal_quantile(double p) {
  double low = -8.0;
  double high = 8.0;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (0.5 * std::erfc(-middle / std::sqrt(2.0)) < p ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace

ImageSensor::ImageSensor(int width, int height, double blur_px, double noise_levels)
    : width_(width), height_(height), noisy_(noise_levels > 0.0) {
  if (blur_px > 0.0 && blur_px <= 0.6) {
    // A narrow Gaussian sampled at pixels loses its width; three taps with its variance keep it.
    const auto side = static_cast<float>(0.5 * blur_px * blur_px);
    kernel_ = {1.0f - 2.0f * side, side};
  } else if (blur_px > 0.6) {
    const int reach = static_cast<int>(std::ceil(3.0 * blur_px));
    double sum = 0.0;
    for (int i = 0; i <= reach; ++i) {
      const double w = std::exp(-0.5 * i * i / (blur_px * blur_px));
      kernel_.push_back(static_cast<float>(w));
      sum += (i == 0 ? 1.0 : 2.0) * w;
    }
    for (auto& w : kernel_) w /= static_cast<float>(sum);
  }
  // Midpoint quantiles lose a little variance in the tails; scale it back.
  double square = 0.0;
  std::array<double, 4096> quantile{};
  for (std::size_t i = 0; i < quantile.size(); ++i) {
    quantile[i] = normal_quantile((static_cast<double>(i) + 0.5) / static_cast<double>(quantile.size()));
    square += quantile[i] * quantile[i];
  }
  const double scale = noise_levels / std::sqrt(square / static_cast<double>(quantile.size()));
  for (std::size_t i = 0; i < quantile.size(); ++i) noise_table_[i] = static_cast<float>(scale * quantile[i]);
}

void ImageSensor::blur(std::vector<float>& light) {
  const int reach = static_cast<int>(kernel_.size()) - 1;
  const int stride = 3 * width_;
  scratch_.resize(light.size());
  // Along columns, then along rows; the border repeats.
  for (int v = 0; v < height_; ++v) {
    float* const out = scratch_.data() + static_cast<std::ptrdiff_t>(v) * stride;
    const float* const centre = light.data() + static_cast<std::ptrdiff_t>(v) * stride;
    for (int i = 0; i < stride; ++i) out[i] = kernel_[0] * centre[i];
    for (int k = 1; k <= reach; ++k) {
      const float* const above = light.data() + static_cast<std::ptrdiff_t>(std::max(0, v - k)) * stride;
      const float* const below = light.data() + static_cast<std::ptrdiff_t>(std::min(height_ - 1, v + k)) * stride;
      const float w = kernel_[static_cast<std::size_t>(k)];
      for (int i = 0; i < stride; ++i) out[i] += w * (above[i] + below[i]);
    }
  }
  for (int v = 0; v < height_; ++v) {
    const float* const in = scratch_.data() + static_cast<std::ptrdiff_t>(v) * stride;
    float* const out = light.data() + static_cast<std::ptrdiff_t>(v) * stride;
    for (int i = 0; i < stride; ++i) out[i] = kernel_[0] * in[i];
    for (int k = 1; k <= reach; ++k) {
      const float w = kernel_[static_cast<std::size_t>(k)];
      const int shift = 3 * k;
      for (int i = shift; i < stride - shift; ++i) out[i] += w * (in[i - shift] + in[i + shift]);
      for (int c = 0; c < 3; ++c) {
        for (int u = 0; u < std::min(k, width_); ++u) {
          out[3 * u + c] += w * (in[c] + in[3 * std::min(width_ - 1, u + k) + c]);
          const int far = width_ - 1 - u;
          if (far >= k) {
            out[3 * far + c] += w * (in[3 * (width_ - 1) + c] + in[3 * std::max(0, far - k) + c]);
          }
        }
      }
    }
  }
}

void ImageSensor::expose(std::vector<float>& light, double exposure, Random& random, Image& picture) {
  if (kernel_.size() > 1) blur(light);
  if (picture.width != width_ || picture.height != height_ || picture.channels != 3) {
    picture = Image(width_, height_, 3);
  }
  const auto gain = static_cast<float>(exposure);
  std::uint64_t bits = 0;
  int left = 0;
  for (std::size_t i = 0; i < light.size(); ++i) {
    float level = gain * light[i] + 0.5f;
    if (noisy_) {
      if (left == 0) {
        bits = random.bits();
        left = 5;
      }
      level += noise_table_[bits & 4095u];
      bits >>= 12;
      --left;
    }
    picture.data[i] = static_cast<std::uint8_t>(std::clamp(level, 0.0f, 255.0f));
  }
}

}  // namespace bodyschema::simulator
