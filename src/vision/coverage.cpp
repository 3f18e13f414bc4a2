#include "coverage.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace bodyschema {
namespace {

// Half the side of the square over which robot colour is averaged at first, px.
constexpr int kRadius = 5;
// Weights of pixels at least two, at least one and zero steps inside the robot: the mean is that
// of the surest kind there is nearby.
constexpr int kCoreWeight = 4096;
constexpr int kInsideWeight = 64;
constexpr int kAnyWeight = 1;
// Depths inside the outline at which the robot's colour is read, px: the first is just beyond the
// blur of the outline, the second shows how colour changes.
constexpr float kNearDepth = 1.4f;
constexpr float kFarDepth = 2.6f;
// Mean depth of the robot's part in a pixel on the outline, px.
constexpr float kEdgeDepth = 0.35f;
// Farther than this from the outline a pixel is all robot or all background, px.
constexpr float kReach = 1.75f;

template <typename Function>
void for_each_set(const BinaryMask& mask, const PixelBox& box, Function&& function) {
  for (int v = box.v0; v <= box.v1; ++v) {
    const auto* row = mask.row(v);
    for (int w = box.u0 >> 6; w <= box.u1 >> 6; ++w) {
      for (std::uint64_t word = row[w]; word != 0; word &= word - 1) {
        const int u = 64 * w + std::countr_zero(word);
        if (u >= box.u0 && u <= box.u1) function(u, v);
      }
    }
  }
}

}  // namespace

void CoverageEstimator::collect_band(const Image& image, const BinaryMask& detected,
                                     const BinaryMask& sure) {
  outer_ = detected;
  morphology_.dilate(outer_);
  weak_ = sure;
  morphology_.erode(weak_);
  core_ = weak_;
  morphology_.erode(core_);
  inner_ = core_;
  morphology_.erode(inner_);
  box_ = bounding_box(outer_).grown(1, image.width, image.height);

  stride_ = box_.width() + 2;
  const auto window = static_cast<std::size_t>(stride_) * static_cast<std::size_t>(box_.height() + 2);
  share_.assign(window, 0.0f);
  band_.clear();
  for_each_set(outer_, box_, [&](int u, int v) {
    const auto local = static_cast<std::size_t>(v - box_.v0 + 1) * static_cast<std::size_t>(stride_) +
                       static_cast<std::size_t>(u - box_.u0 + 1);
    if (inner_.at(u, v)) {
      share_[local] = 1.0f;
    } else {
      band_.push_back({u, v, local, {}, 0.0f, false});
    }
  });
}

void CoverageEstimator::average_robot(const Image& image, const BinaryMask& sure) {
  const auto channels = static_cast<std::size_t>(image.channels);
  const auto width = static_cast<std::size_t>(box_.width());
  const auto height = static_cast<std::size_t>(box_.height());
  for (std::size_t c = 0; c <= channels; ++c) {
    sums_[c].resize(width * height);
    columns_[c].assign(width, 0);
  }
  for (int v = box_.v0; v <= box_.v1; ++v) {
    std::array<int, 4> running{};
    const auto accumulate = [&](int u, int sign) {
      if (u < box_.u0 || u > box_.u1 || !sure.at(u, v)) return;
      const int weight = sign * (core_.at(u, v)   ? kCoreWeight
                                 : weak_.at(u, v) ? kInsideWeight
                                                  : kAnyWeight);
      const auto* pixel = image.pixel(u, v);
      for (std::size_t c = 0; c < channels; ++c) running[c] += weight * pixel[c];
      running[channels] += weight;
    };
    auto index = static_cast<std::size_t>(v - box_.v0) * width;
    for (int u = box_.u0; u < box_.u0 + kRadius; ++u) accumulate(u, 1);
    for (int u = box_.u0; u <= box_.u1; ++u, ++index) {
      accumulate(u + kRadius, 1);
      for (std::size_t c = 0; c <= channels; ++c) sums_[c][index] = running[c];
      accumulate(u - kRadius, -1);
    }
  }
  const auto add_row = [&](int v, int sign) {
    if (v < box_.v0 || v > box_.v1) return;
    for (std::size_t c = 0; c <= channels; ++c) {
      const int* row = sums_[c].data() + static_cast<std::size_t>(v - box_.v0) * width;
      int* column = columns_[c].data();
      for (std::size_t u = 0; u < width; ++u) column[u] += sign * row[u];
    }
  };
  for (int v = box_.v0; v < box_.v0 + kRadius; ++v) add_row(v, 1);
  int summed_for = box_.v0 - 1;
  for (auto& pixel : band_) {
    for (; summed_for < pixel.v; ++summed_for) {  // the band is in row order
      add_row(summed_for + 1 + kRadius, 1);
      add_row(summed_for - kRadius, -1);
    }
    const auto u = static_cast<std::size_t>(pixel.u - box_.u0);
    const int weight = columns_[channels][u];
    for (std::size_t c = 0; c < channels; ++c) {
      pixel.robot[c] = weight > 0 ? static_cast<float>(columns_[c][u]) / static_cast<float>(weight)
                                  : static_cast<float>(image.pixel(pixel.u, pixel.v)[c]);
    }
  }
}

void CoverageEstimator::project(const Image& image, const BackgroundModel& background,
                                float least_contrast_sigma) {
  const auto channels = static_cast<std::size_t>(image.channels);
  for (auto& pixel : band_) {
    const auto i = static_cast<std::size_t>(pixel.v) * static_cast<std::size_t>(image.width) +
                   static_cast<std::size_t>(pixel.u);
    const auto* colour = image.pixel(pixel.u, pixel.v);
    float difference = 0.0f;  // |I - B|^2
    float contrast = 0.0f;    // |F - B|^2
    float along = 0.0f;       // (I - B).(F - B)
    for (std::size_t c = 0; c < channels; ++c) {
      const float b = background.mean[c][i];
      const float d = static_cast<float>(colour[c]) - b;
      const float f = pixel.robot[c] - b;
      difference += d * d;
      contrast += f * f;
      along += d * f;
    }
    const float precision = background.precision[i];
    const float least = least_contrast_sigma * least_contrast_sigma;
    pixel.known = contrast * precision >= least && precision > 0.0f;
    pixel.share = contrast > 1e-6f ? along / contrast : 0.0f;
    // A colour that no mixture of F and B explains is that of another part of the robot.
    const float across = difference - pixel.share * along;
    if (pixel.share < 0.5f && across * precision > std::max(25.0f, 0.25f * difference * precision)) {
      pixel.share = 1.0f;
    }
    pixel.share = std::clamp(pixel.share, -0.25f, 1.25f);
  }
  for (const auto& pixel : band_) share_[pixel.local] = pixel.share;
}

void CoverageEstimator::place_outline(const Image& image, const BackgroundModel& background) {
  const auto channels = static_cast<std::size_t>(image.channels);
  const auto s = static_cast<std::ptrdiff_t>(stride_);
  const auto width = static_cast<float>(image.width - 1);
  const auto height = static_cast<float>(image.height - 1);
  // Reads the picture between pixels; nothing where that is not inside the robot.
  const auto read = [&](float u, float v, std::array<float, 3>& colour) {
    if (!(u >= 0.0f && v >= 0.0f && u <= width && v <= height)) return false;
    const int iu = std::min(static_cast<int>(u), std::max(image.width - 2, 0));
    const int iv = std::min(static_cast<int>(v), std::max(image.height - 2, 0));
    if (iu < box_.u0 || iv < box_.v0 || iu > box_.u1 || iv > box_.v1) return false;
    const float fu = u - static_cast<float>(iu);
    const float fv = v - static_cast<float>(iv);
    const auto local = static_cast<std::size_t>(iv - box_.v0 + 1) * static_cast<std::size_t>(stride_) +
                       static_cast<std::size_t>(iu - box_.u0 + 1);
    const float w00 = (1.0f - fu) * (1.0f - fv), w10 = fu * (1.0f - fv), w01 = (1.0f - fu) * fv,
                w11 = fu * fv;
    const auto* share = share_.data() + local;
    const float inside = w00 * share[0] + w10 * share[1] + w01 * share[s] + w11 * share[s + 1];
    if (inside < 0.9f) return false;
    const auto* p = image.pixel(iu, iv);
    const auto* below = p + static_cast<std::ptrdiff_t>(image.width) * image.channels;
    for (std::size_t c = 0; c < channels; ++c) {
      colour[c] = w00 * p[c] + w10 * p[channels + c] + w01 * below[c] + w11 * below[channels + c];
    }
    return true;
  };
  for (auto& pixel : band_) {
    const float* a = share_.data() + pixel.local;
    const float left = a[-s - 1] + 2.0f * a[-1] + a[s - 1];
    const float right = a[-s + 1] + 2.0f * a[1] + a[s + 1];
    const float top = a[-s - 1] + 2.0f * a[-s] + a[-s + 1];
    const float bottom = a[s - 1] + 2.0f * a[s] + a[s + 1];
    const float smooth = (left + right + 2.0f * (a[-s] + 2.0f * a[0] + a[s])) / 16.0f;
    const float gu = (left - right) / 8.0f;  // towards the background
    const float gv = (top - bottom) / 8.0f;
    const float steepness = std::sqrt(gu * gu + gv * gv);
    if (steepness < 0.04f) continue;
    const float nu = gu / steepness;
    const float nv = gv / steepness;
    const float depth = std::clamp((smooth - 0.5f) * 2.5f, -kReach, kReach);  // inside: positive
    const auto u = static_cast<float>(pixel.u) + nu * depth;
    const auto v = static_cast<float>(pixel.v) + nv * depth;

    // The mean of three places side by side, at two depths.
    std::array<float, 3> near{};
    std::array<float, 3> far{};
    int near_count = 0;
    int far_count = 0;
    for (int side = -1; side <= 1; ++side) {
      const float su = u - nv * static_cast<float>(side);
      const float sv = v + nu * static_cast<float>(side);
      std::array<float, 3> colour{};
      if (read(su - nu * kNearDepth, sv - nv * kNearDepth, colour)) {
        ++near_count;
        for (std::size_t c = 0; c < channels; ++c) near[c] += colour[c];
      }
      if (read(su - nu * kFarDepth, sv - nv * kFarDepth, colour)) {
        ++far_count;
        for (std::size_t c = 0; c < channels; ++c) far[c] += colour[c];
      }
    }
    if (near_count == 0) continue;
    const auto i = static_cast<std::size_t>(pixel.v) * static_cast<std::size_t>(image.width) +
                   static_cast<std::size_t>(pixel.u);
    static const float kGain = (std::sqrt(kNearDepth) - std::sqrt(kEdgeDepth)) /
                               (std::sqrt(kFarDepth) - std::sqrt(kNearDepth));
    float change = 0.0f;
    float contrast = 0.0f;
    std::array<float, 3> step{};
    for (std::size_t c = 0; c < channels; ++c) {
      near[c] /= static_cast<float>(near_count);
      step[c] = far_count == 0 ? 0.0f : kGain * (near[c] - far[c] / static_cast<float>(far_count));
      const float f = near[c] - background.mean[c][i];
      change += step[c] * step[c];
      contrast += f * f;
    }
    // A change as large as the contrast is a border between parts, not shading.
    const float most = 0.5f * std::sqrt(contrast);
    const float scale = change > most * most ? most / std::sqrt(change) : 1.0f;
    for (std::size_t c = 0; c < channels; ++c) {
      pixel.robot[c] = std::clamp(near[c] + scale * step[c], 0.0f, 255.0f);
    }
  }
}

void CoverageEstimator::estimate(const Image& image, const BackgroundModel& background,
                                 const BinaryMask& detected, const BinaryMask& sure,
                                 float least_contrast_sigma, BinaryMask& mask,
                                 BinaryMask& uncertain, std::vector<std::uint8_t>& coverage) {
  const auto pixels = static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
  coverage.assign(pixels, 0);
  mask.fill(false);
  uncertain.fill(false);
  collect_band(image, detected, sure);
  if (box_.empty()) return;
  average_robot(image, sure);
  project(image, background, least_contrast_sigma);
  for (int round = 0; round < 2; ++round) {
    place_outline(image, background);
    project(image, background, least_contrast_sigma);
  }

  const auto width = static_cast<std::size_t>(image.width);
  for_each_set(inner_, box_, [&](int u, int v) {
    coverage[static_cast<std::size_t>(v) * width + static_cast<std::size_t>(u)] = 255;
  });
  mask = inner_;
  for (const auto& pixel : band_) {
    float share = pixel.share;
    if (!pixel.known) {
      uncertain.set(pixel.u, pixel.v);
      share = sure.at(pixel.u, pixel.v) ? 1.0f : 0.0f;
    }
    const auto level = static_cast<std::uint8_t>(std::clamp(share, 0.0f, 1.0f) * 255.0f + 0.5f);
    coverage[static_cast<std::size_t>(pixel.v) * width + static_cast<std::size_t>(pixel.u)] = level;
    if (level >= 128) mask.set(pixel.u, pixel.v);
  }
}

}  // namespace bodyschema
