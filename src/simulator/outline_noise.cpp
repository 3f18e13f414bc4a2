#include "bodyschema/simulator/outline_noise.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "bodyschema/geometry/pose.hpp"
#include "bodyschema/simulator/random.hpp"

namespace bodyschema::simulator {

OutlineDisplacer::OutlineDisplacer(int width, int height, const OutlineNoise& noise, std::uint64_t seed,
                                   const std::string& purpose)
    : width_(width), height_(height), noise_(noise), seed_(seed), purpose_(purpose) {
  // Waves of normally distributed wave numbers add up to a field that correlates as exp(-d^2 / (2 length^2)), those
  // of frequencies distributed after Cauchy to one that does as exp(-t / time) (Bochner's theorem).
  Random random(seed, purpose + " waves");
  for (int i = 0; i < kFields * kWaves; ++i) {
    Wave wave{};
    wave.kx = static_cast<float>(random.normal() / noise_.length_px);
    wave.ky = static_cast<float>(random.normal() / noise_.length_px);
    wave.phase = random.uniform(0.0, 2.0 * kPi);
    if (noise_.time_s > 0.0) wave.omega = std::tan(kPi * (random.uniform() - 0.5)) / noise_.time_s;
    waves_.push_back(wave);
  }
  // The outline's normal comes from a softened mask, as wide as outlines move.
  const double soft_px = std::max(1.2, 1.2 * noise_.sd_px);
  const int reach = static_cast<int>(std::ceil(3.5 * soft_px));
  double sum = 0.0;
  for (int i = 0; i <= reach; ++i) {
    kernel_.push_back(static_cast<float>(std::exp(-0.5 * i * i / (soft_px * soft_px))));
    sum += (i == 0 ? 1.0 : 2.0) * static_cast<double>(kernel_.back());
  }
  for (auto& k : kernel_) k /= static_cast<float>(sum);
}

void OutlineDisplacer::displace(double t_s, std::int64_t index, std::vector<float>& coverage) {
  if (noise_.sd_px <= 0.0) return;
  const auto at = [&](int u, int v) {
    return static_cast<std::size_t>(v) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(u);
  };
  int u0 = width_, u1 = 0, v0 = height_, v1 = 0;
  for (int v = 0; v < height_; ++v) {
    for (int u = 0; u < width_; ++u) {
      if (coverage[at(u, v)] <= 0.0f) continue;
      u0 = std::min(u0, u);
      u1 = std::max(u1, u + 1);
      v0 = std::min(v0, v);
      v1 = std::max(v1, v + 1);
    }
  }
  if (u1 <= u0) return;
  const int reach = static_cast<int>(kernel_.size());
  u0 = std::max(0, u0 - reach);
  v0 = std::max(0, v0 - reach);
  u1 = std::min(width_, u1 + reach);
  v1 = std::min(height_, v1 + reach);

  if (noise_.time_s > 0.0) {
    for (auto& wave : waves_) wave.now = static_cast<float>(std::remainder(wave.omega * t_s + wave.phase, 2.0 * kPi));
  } else {
    Random random(seed_, purpose_ + " phases", static_cast<std::uint64_t>(index));
    for (auto& wave : waves_) wave.now = static_cast<float>(random.uniform(0.0, 2.0 * kPi));
  }

  // The picture's border is no outline: what is beyond it is as what is at it.
  soft_.assign(coverage.size(), 0.0f);
  scratch_.assign(coverage.size(), 0.0f);
  for (int v = v0; v < v1; ++v) {
    for (int u = u0; u < u1; ++u) {
      float sum = kernel_[0] * coverage[at(u, v)];
      for (int k = 1; k < reach; ++k) {
        sum += kernel_[static_cast<std::size_t>(k)] *
               (coverage[at(std::max(0, u - k), v)] + coverage[at(std::min(width_ - 1, u + k), v)]);
      }
      scratch_[at(u, v)] = sum;
    }
  }
  for (int v = v0; v < v1; ++v) {
    for (int u = u0; u < u1; ++u) {
      float sum = kernel_[0] * scratch_[at(u, v)];
      for (int k = 1; k < reach; ++k) {
        sum += kernel_[static_cast<std::size_t>(k)] *
               (scratch_[at(u, std::max(0, v - k))] + scratch_[at(u, std::min(height_ - 1, v + k))]);
      }
      soft_[at(u, v)] = sum;
    }
  }
  const auto value = [&](float u, float v) {
    u = std::clamp(u, 0.0f, static_cast<float>(width_ - 1));
    v = std::clamp(v, 0.0f, static_cast<float>(height_ - 1));
    const int i = std::min(static_cast<int>(u), width_ - 2), j = std::min(static_cast<int>(v), height_ - 2);
    const float a = u - static_cast<float>(i), b = v - static_cast<float>(j);
    return (1 - b) * ((1 - a) * coverage[at(i, j)] + a * coverage[at(i + 1, j)]) +
           b * ((1 - a) * coverage[at(i, j + 1)] + a * coverage[at(i + 1, j + 1)]);
  };
  constexpr float kFlat = 1e-3f;  // no outline near
  const float scale = static_cast<float>(noise_.sd_px * std::sqrt(2.0 / kWaves) * std::sqrt(0.5));
  moved_ = coverage;
  for (int v = std::max(1, v0); v < std::min(height_ - 1, v1); ++v) {
    for (int u = std::max(1, u0); u < std::min(width_ - 1, u1); ++u) {
      const float gx = 0.5f * (soft_[at(u + 1, v)] - soft_[at(u - 1, v)]);
      const float gy = 0.5f * (soft_[at(u, v + 1)] - soft_[at(u, v - 1)]);
      const float slope = std::hypot(gx, gy);
      if (slope < kFlat) continue;
      const float nx = -gx / slope, ny = -gy / slope;  // outwards
      std::array<float, kFields> field{};
      for (std::size_t i = 0; i < waves_.size(); ++i) {
        const Wave& wave = waves_[i];
        field[i / kWaves] += std::cos(wave.kx * static_cast<float>(u) + wave.ky * static_cast<float>(v) + wave.now);
      }
      // Outwards on one side of a finger is against the field that is outwards on the other: together with a field
      // that is the same for both they are independent.
      const float d = scale * (field[0] * nx + field[1] * ny + field[2]);
      moved_[at(u, v)] = value(static_cast<float>(u) - d * nx, static_cast<float>(v) - d * ny);
    }
  }
  coverage.swap(moved_);
}

}  // namespace bodyschema::simulator
