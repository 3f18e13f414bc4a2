#include "coverage.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace bodyschema {
namespace {

// Where the robot is too thin to look inside, its colour is the mean over a square with this half
// side, px.
constexpr int kRadius = 5;
// Weights of pixels at least two, at least one and zero steps inside the robot: the mean is that
// of the surest kind there is nearby.
constexpr int kCoreWeight = 4096;
constexpr int kInsideWeight = 64;
constexpr int kAnyWeight = 1;
// Depths inside the outline at which the robot's colour is read, px: the first is just beyond the
// blur of the outline, the second shows how colour changes.
constexpr float kNearDepth = 1.5f;
constexpr float kFarDepth = 3.1f;
// Colour of compressed pictures is kept at half the resolution and less: that deep it is the robot's alone.
constexpr float kColourDepth = 3.5f;
// Mean depth of the robot's part in a pixel on the outline, px.
constexpr float kEdgeDepth = 0.35f;
// Farther than this from the outline a pixel is all robot or all background, px.
constexpr float kReach = 1.75f;
// The same where colour bleeds over the outline; its ramp is no flatter than this, per px.
constexpr float kReachOfColour = 2.5f;
constexpr float kLeastSlopeOfColour = 0.15f;

/// By what colour changes from the near depth to this one, times what it changes by from a far one to the near one.
float gain(float depth, float far) {
  return (std::sqrt(kNearDepth) - std::sqrt(depth)) / (std::sqrt(far) - std::sqrt(kNearDepth));
}

// How far beyond the outline pixels can differ from the background by their blur, px.
constexpr float kRoughMargin = 0.9f;
// A place is overexposed from so many standard deviations of the noise below the brightest level on. Light from all
// around leaves it no darker than this share in its own shade, and tints that by no more than a quarter of the change.
constexpr float kOverexposedSigma = 2.0f, kDarkestShade = 0.5f, kTint = 0.25f;
// The smoothed coverage has no direction where it is flatter than this, per px.
constexpr float kLeastSlope = 0.1f;
// Robot colour is read where the smoothed coverage is at least this. Less would mix background in;
// more would pick, by their noise, pixels that differ most from the background.
constexpr float kInside = 0.8f;

/// The largest squared difference between a pixel's background and its neighbours': on a sharp
/// border in the background the uncovered part of a pixel need not have the pixel's mean colour.
float background_change(const BackgroundModel& background, int u, int v) {
  const auto channels = static_cast<std::size_t>(background.channels);
  const auto at = [&](int a, int b) {
    return background.mean.data() +
           (static_cast<std::size_t>(b) * static_cast<std::size_t>(background.width) + static_cast<std::size_t>(a)) *
               channels;
  };
  const float* here = at(u, v);
  float largest = 0.0f;
  const auto compare = [&](int a, int b) {
    if (a < 0 || b < 0 || a >= background.width || b >= background.height) return;
    const float* there = at(a, b);
    float sum = 0.0f;
    for (std::size_t c = 0; c < channels; ++c) sum += (there[c] - here[c]) * (there[c] - here[c]);
    largest = std::max(largest, sum);
  };
  compare(u - 1, v);
  compare(u + 1, v);
  compare(u, v - 1);
  compare(u, v + 1);
  return largest;
}

// Of red, green and blue in what JPEG and video call luma.
constexpr std::array<float, 3> kBrightness = {0.299f, 0.587f, 0.114f};
// Compression keeps colour in coarser steps than brightness: its errors beside an outline are larger, and it changes so
// slowly there that the same error moves an outline by several times as much. Squared.
constexpr float kColourVariance = 2.0f;
// Levels, squared: the robot's brightness on the outline, from pixels that each err by two, is known no better.
constexpr float kBrightnessVariance = 16.0f;

float brightness_of(const std::array<float, 3>& colour) {
  float sum = 0.0f;
  for (std::size_t c = 0; c < kBrightness.size(); ++c) sum += kBrightness[c] * colour[c];
  return sum;
}

/// Where the difference of a pixel from its background lies on the way to the robot's, both as brightness and colour
/// of compressed pictures tell it, by their variances.
float share_by_brightness(const std::array<float, 3>& seen, const std::array<float, 3>& inside) {
  const float seen_brightness = brightness_of(seen), brightness = brightness_of(inside);
  float along = 0.0f, contrast = 0.0f;
  // The square of a number that is not known well is too large by its variance.
  if (const float square = brightness * brightness - kBrightnessVariance; square > 0.0f) {
    along = 3.0f * seen_brightness * brightness;
    contrast = 3.0f * square;
  }
  for (std::size_t c = 0; c < seen.size(); ++c) {
    const float colour = inside[c] - brightness;
    along += (seen[c] - seen_brightness) * colour / kColourVariance;
    contrast += colour * colour / kColourVariance;
  }
  return contrast > 1e-6f ? along / contrast : 0.0f;
}

/// Whether the background may be what shading makes of an overexposed robot, of whose shading nothing is seen.
/// @param robot  its colour just inside the outline
/// @param clipped  the level that no channel exceeds
bool fades_unseen(const std::array<float, 3>& robot, const BackgroundModel& background, std::size_t pixel,
                  const std::array<float, 3>& clipped) {
  const auto channels = static_cast<std::size_t>(background.channels);
  const float* behind = background.mean.data() + pixel * channels;
  bool overexposed = false;
  float square = 0.0f, product = 0.0f, along = 0.0f, contrast = 0.0f;
  for (std::size_t c = 0; c < channels; ++c) {
    const float f = robot[c] - behind[c];
    overexposed = overexposed || robot[c] > clipped[c] - kOverexposedSigma * background.noise_sd;
    square += robot[c] * robot[c];
    product += robot[c] * behind[c];
    along += robot[c] * f;
    contrast += f * f;
  }
  return overexposed && along > 0.0f && product > kDarkestShade * square &&
         along * along > (1.0f - kTint * kTint) * square * contrast;
}

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

void CoverageEstimator::collect_band(const Image& image, const BinaryMask& detected, const BinaryMask& sure) {
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
  smooth_.assign(window, 0.0f);
  band_.clear();
  for_each_set(outer_, box_, [&](int u, int v) {
    const auto local = static_cast<std::size_t>(v - box_.v0 + 1) * static_cast<std::size_t>(stride_) +
                       static_cast<std::size_t>(u - box_.u0 + 1);
    if (inner_.at(u, v)) {
      share_[local] = 1.0f;
      smooth_[local] = 1.0f;
    } else {
      BandPixel pixel{};
      pixel.u = u;
      pixel.v = v;
      pixel.local = local;
      pixel.share = sure.at(u, v) ? 1.0f : 0.0f;
      share_[local] = pixel.share;
      band_.push_back(pixel);
    }
  });
}

void CoverageEstimator::average_nearby(const Image& image, const BinaryMask& sure, BandPixel& pixel) const {
  const auto channels = static_cast<std::size_t>(image.channels);
  std::array<int, 3> sum{};
  int weights = 0;
  for (int v = std::max(pixel.v - kRadius, box_.v0); v <= std::min(pixel.v + kRadius, box_.v1); ++v) {
    for (int u = std::max(pixel.u - kRadius, box_.u0); u <= std::min(pixel.u + kRadius, box_.u1); ++u) {
      if (!sure.at(u, v)) continue;
      const int weight = core_.at(u, v) ? kCoreWeight : (weak_.at(u, v) ? kInsideWeight : kAnyWeight);
      const auto* colour = image.pixel(u, v);
      for (std::size_t c = 0; c < channels; ++c) sum[c] += weight * colour[c];
      weights += weight;
    }
  }
  if (weights == 0) return;
  for (std::size_t c = 0; c < channels; ++c) {
    pixel.robot[c] = static_cast<float>(sum[c]) / static_cast<float>(weights);
  }
  pixel.robot_known = true;
}

void CoverageEstimator::project(const Image& image, const BackgroundModel& background, float least_contrast_sigma,
                                bool sharp_colours) {
  const auto channels = static_cast<std::size_t>(image.channels);
  for (auto& pixel : band_) {
    if (!pixel.robot_known) continue;
    const auto i =
        static_cast<std::size_t>(pixel.v) * static_cast<std::size_t>(image.width) + static_cast<std::size_t>(pixel.u);
    const auto* colour = image.pixel(pixel.u, pixel.v);
    float difference = 0.0f;  // |I - B|^2
    float contrast = 0.0f;    // |F - B|^2
    float along = 0.0f;       // (I - B).(F - B)
    std::array<float, 3> seen{}, inside{};
    for (std::size_t c = 0; c < channels; ++c) {
      const float b = background.mean[i * channels + c];
      const float d = static_cast<float>(colour[c]) - b;
      const float f = pixel.robot[c] - b;
      difference += d * d;
      contrast += f * f;
      along += d * f;
      seen[c] = d;
      inside[c] = f;
    }
    const float precision = background.precision[i];
    const float least = least_contrast_sigma * least_contrast_sigma;
    pixel.contrast = contrast * precision >= least && precision > 0.0f;
    pixel.share = contrast > 1e-6f ? along / contrast : 0.0f;
    if (!sharp_colours && channels == 3) pixel.share = share_by_brightness(seen, inside);
    // A colour that no mixture of F and B explains is that of another part of the robot.
    const float across = difference - pixel.share * along;
    if (sharp_colours && pixel.share < 0.5f && across * precision > std::max(25.0f, 0.25f * difference * precision) &&
        across > background_change(background, pixel.u, pixel.v)) {
      pixel.share = 1.0f;
    }
    pixel.share = std::clamp(pixel.share, -0.25f, 1.25f);
  }
  for (const auto& pixel : band_) share_[pixel.local] = pixel.share;
}

void CoverageEstimator::smooth() {
  const auto s = static_cast<std::ptrdiff_t>(stride_);
  for (auto& pixel : band_) {
    const float* a = share_.data() + pixel.local;
    const float left = a[-s - 1] + 2.0f * a[-1] + a[s - 1];
    const float right = a[-s + 1] + 2.0f * a[1] + a[s + 1];
    const float top = a[-s - 1] + 2.0f * a[-s] + a[-s + 1];
    const float bottom = a[s - 1] + 2.0f * a[s] + a[s + 1];
    pixel.smooth = (left + right + 2.0f * (a[-s] + 2.0f * a[0] + a[s])) / 16.0f;
    pixel.slope_u = (left - right) / 8.0f;
    pixel.slope_v = (top - bottom) / 8.0f;
    smooth_[pixel.local] = pixel.smooth;
  }
}

void CoverageEstimator::look_inside(const Image& image, const BackgroundModel& background, const BinaryMask& sure,
                                    bool rough, bool sharp_colours) {
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
    const float w00 = (1.0f - fu) * (1.0f - fv), w10 = fu * (1.0f - fv), w01 = (1.0f - fu) * fv, w11 = fu * fv;
    const auto* share = smooth_.data() + local;
    const float inside = w00 * share[0] + w10 * share[1] + w01 * share[s] + w11 * share[s + 1];
    if (inside < kInside) return false;
    const auto* p = image.pixel(iu, iv);
    const auto* below = p + static_cast<std::ptrdiff_t>(image.width) * image.channels;
    for (std::size_t c = 0; c < channels; ++c) {
      colour[c] = w00 * p[c] + w10 * p[channels + c] + w01 * below[c] + w11 * below[channels + c];
    }
    return true;
  };
  for (auto& pixel : band_) {
    const float steepness = std::hypot(pixel.slope_u, pixel.slope_v);
    if (steepness < kLeastSlope) continue;
    const float nu = pixel.slope_u / steepness;
    const float nv = pixel.slope_v / steepness;
    float depth = std::clamp((pixel.smooth - 0.5f) * 2.5f, -kReach, kReach) - (rough ? kRoughMargin : 0.0f);
    if (!sharp_colours && !rough) {
      depth =
          std::clamp((pixel.smooth - 0.5f) / std::max(steepness, kLeastSlopeOfColour), -kReachOfColour, kReachOfColour);
    }
    const auto u = static_cast<float>(pixel.u) + nu * depth;
    const auto v = static_cast<float>(pixel.v) + nv * depth;

    // The mean of three places side by side, at two depths; one place is enough at first.
    std::array<float, 3> near{};
    std::array<float, 3> far{};
    int near_count = 0;
    int far_count = 0;
    const auto add = [&](int side, float beneath, std::array<float, 3>& sum, int& count) {
      const float across = static_cast<float>(side);
      std::array<float, 3> colour{};
      if (!read(u - nv * across - nu * beneath, v + nu * across - nv * beneath, colour)) return;
      ++count;
      for (std::size_t c = 0; c < channels; ++c) sum[c] += colour[c];
    };
    const int sides = rough ? 0 : 1;
    for (int side = -sides; side <= sides; ++side) {
      add(side, kNearDepth, near, near_count);
      add(side, sharp_colours ? kFarDepth : kColourDepth, far, far_count);
    }
    if (near_count == 0) {
      if (!pixel.robot_known) average_nearby(image, sure, pixel);
      continue;
    }
    const auto i =
        static_cast<std::size_t>(pixel.v) * static_cast<std::size_t>(image.width) + static_cast<std::size_t>(pixel.u);
    for (std::size_t c = 0; c < channels; ++c) {
      near[c] /= static_cast<float>(near_count);
      far[c] = far_count == 0 ? near[c] : far[c] / static_cast<float>(far_count);
    }
    std::array<float, 3> step{};
    if (sharp_colours) {
      for (std::size_t c = 0; c < channels; ++c) step[c] = gain(kEdgeDepth, kFarDepth) * (near[c] - far[c]);
    } else {
      // Brightness by the law, at the pixel's own depth; what colours change by beside an outline is no shading.
      const float change = gain(std::clamp(depth, kEdgeDepth, kNearDepth), kColourDepth);
      if (channels == 1) {
        step[0] = change * (near[0] - far[0]);
      } else {
        const float brightness = brightness_of(near), deep = brightness_of(far);
        for (std::size_t c = 0; c < channels; ++c) {
          near[c] = brightness + (far[c] - deep);
          step[c] = change * (brightness - deep);
        }
      }
    }
    float change = 0.0f;
    float contrast = 0.0f;
    for (std::size_t c = 0; c < channels; ++c) {
      const float f = near[c] - background.mean[i * channels + c];
      change += step[c] * step[c];
      contrast += f * f;
    }
    // A change as large as the contrast is a border between parts, not shading.
    const float most = 0.5f * std::sqrt(contrast);
    const float scale = change > most * most ? most / std::sqrt(change) : 1.0f;
    for (std::size_t c = 0; c < channels; ++c) {
      pixel.robot[c] = std::clamp(near[c] + scale * step[c], 0.0f, 255.0f);
    }
    pixel.robot_known = true;
    pixel.fades = fades_unseen(near, background, i, clipped_);
  }
}

void CoverageEstimator::estimate(const Image& image, const BackgroundModel& background, const BinaryMask& detected,
                                 const BinaryMask& sure, const std::array<float, 3>& clipped,
                                 float least_contrast_sigma, bool sharp_colours, BinaryMask& mask,
                                 BinaryMask& uncertain, std::vector<std::uint8_t>& coverage) {
  const auto pixels = static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
  clipped_ = clipped;
  coverage.assign(pixels, 0);
  mask.fill(false);
  uncertain.fill(false);
  collect_band(image, detected, sure);
  if (box_.empty()) return;
  const int rounds = sharp_colours ? 2 : 3;
  for (int round = 0; round < rounds; ++round) {
    smooth();
    look_inside(image, background, sure, round == 0, sharp_colours);
    project(image, background, least_contrast_sigma, sharp_colours);
  }

  const auto width = static_cast<std::size_t>(image.width);
  for_each_set(inner_, box_, [&](int u, int v) {
    coverage[static_cast<std::size_t>(v) * width + static_cast<std::size_t>(u)] = 255;
  });
  mask = inner_;
  for (const auto& pixel : band_) {
    float share = pixel.share;
    if (pixel.robot_known && (!pixel.contrast || pixel.fades)) {
      uncertain.set(pixel.u, pixel.v);
      share = sure.at(pixel.u, pixel.v) ? 1.0f : 0.0f;
    }
    const auto level = static_cast<std::uint8_t>(std::clamp(share, 0.0f, 1.0f) * 255.0f + 0.5f);
    coverage[static_cast<std::size_t>(pixel.v) * width + static_cast<std::size_t>(pixel.u)] = level;
    if (level >= 128) mask.set(pixel.u, pixel.v);
  }
}

}  // namespace bodyschema
