#include "shown_steps.hpp"

#include <array>
#include <cmath>

#include "limits.hpp"

namespace bodyschema {
namespace {

// Pixels of a 320x240 picture: how far from the outline steps are looked for, how near the largest must lie, and how
// far on either side of a step colours are taken, to both sides of what blurs it.
constexpr int kReach_px = 5, kOnOutline_px = 1;
constexpr std::array<double, 2> kBeside_px = {1.0, 2.0};
constexpr double kMargin_px = 8.0;

/// Square of the step of colour at a place along a normal, levels^2 times the square of the number of pixels on a side.
int step_square(const Image& image, const Eigen::Vector2d& at, const Eigen::Vector2d& normal, double unit_px) {
  std::array<int, 3> step{};
  for (const double beside : kBeside_px) {
    const Eigen::Vector2d in = at - beside * unit_px * normal, out = at + beside * unit_px * normal;
    const auto* a = image.pixel(static_cast<int>(std::lround(in.x())), static_cast<int>(std::lround(in.y())));
    const auto* b = image.pixel(static_cast<int>(std::lround(out.x())), static_cast<int>(std::lround(out.y())));
    for (int c = 0; c < image.channels; ++c) step[static_cast<std::size_t>(c)] += a[c] - b[c];
  }
  return step[0] * step[0] + step[1] * step[1] + step[2] * step[2];
}

}  // namespace

ShownSteps shown_steps(const Image& image, std::span<const OutlineSample> samples, double unit_px) {
  ShownSteps result;
  const double margin_px = kMargin_px * unit_px;
  for (const auto& sample : samples) {
    const Eigen::Vector2d& pixel = sample.pixel;
    if (sample.covered || pixel.x() < margin_px || pixel.y() < margin_px || pixel.x() > image.width - 1 - margin_px ||
        pixel.y() > image.height - 1 - margin_px) {
      continue;
    }
    int largest = 0, place = kReach_px;
    for (int i = -kReach_px; i <= kReach_px; ++i) {
      const int square = step_square(image, pixel + i * unit_px * sample.normal, sample.normal, unit_px);
      if (square <= largest) continue;
      largest = square;
      place = i;
    }
    result.looked += 1.0;
    result.shown += std::abs(place) <= kOnOutline_px;
  }
  return result;
}

std::optional<double> shown_share(const Frame& frame, const FrameEvidence& evidence) {
  ShownSteps all;
  for (std::size_t c = 0; c < evidence.samples.size(); ++c) {
    const auto* seen = frame.seen[c];
    if (seen == nullptr || seen->image.empty()) continue;
    const double unit_px = picture_unit(seen->image.width, seen->image.height);
    const ShownSteps own = shown_steps(seen->image, evidence.samples[c], unit_px);
    all.looked += own.looked;
    all.shown += own.shown;
  }
  if (all.looked < limits::kFewestPoints) return std::nullopt;
  return all.shown / all.looked;
}

}  // namespace bodyschema
