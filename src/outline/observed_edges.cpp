#include "bodyschema/outline/observed_edges.hpp"

#include <cmath>

namespace bodyschema {
namespace {

constexpr double kStep_px = 0.5;
constexpr double kHalf = 127.5;
constexpr double kUnknown = -1.0;

/// Between a step and the next one outwards along the normal.
std::optional<double> crossing(int step, double inner, double outer) {
  if (inner < kHalf || outer < 0.0 || outer >= kHalf) return std::nullopt;
  return kStep_px * (step + (inner - kHalf) / (inner - outer));
}

}  // namespace

ObservedEdges::ObservedEdges(std::span<const std::uint8_t> coverage, const BinaryMask& mask, const BinaryMask& valid,
                             int width, int height)
    : coverage_(coverage), mask_(mask), valid_(valid), width_(width), height_(height) {}

double ObservedEdges::value(int u, int v) const {
  if (coverage_.empty()) return mask_.at(u, v) ? 255.0 : 0.0;
  return coverage_[static_cast<std::size_t>(v) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(u)];
}

/// Coverage between pixels, bilinear; kUnknown where nothing is known.
double ObservedEdges::at(double u, double v) const {
  const double fu = std::floor(u), fv = std::floor(v);
  const int u0 = static_cast<int>(fu), v0 = static_cast<int>(fv);
  if (u0 < 0 || v0 < 0 || u0 + 1 >= width_ || v0 + 1 >= height_) return kUnknown;
  if (!valid_.empty() &&
      !(valid_.at(u0, v0) && valid_.at(u0 + 1, v0) && valid_.at(u0, v0 + 1) && valid_.at(u0 + 1, v0 + 1))) {
    return kUnknown;
  }
  const double a = u - fu, b = v - fv;
  return (1 - b) * ((1 - a) * value(u0, v0) + a * value(u0 + 1, v0)) +
         b * ((1 - a) * value(u0, v0 + 1) + a * value(u0 + 1, v0 + 1));
}

std::optional<double> ObservedEdges::find(const Eigen::Vector2d& pixel, const Eigen::Vector2d& normal,
                                          double search_px) const {
  // Outwards from the prediction both ways, so that a good one costs few pixels.
  const int steps = static_cast<int>(std::ceil(search_px / kStep_px));
  const auto value_at = [&](int step) {
    return at(pixel.x() + step * kStep_px * normal.x(), pixel.y() + step * kStep_px * normal.y());
  };
  double last_out = value_at(0), last_in = last_out;
  for (int i = 1; i <= steps; ++i) {
    const double out = value_at(i), in = value_at(-i);
    auto outside = crossing(i - 1, last_out, out);
    const auto inside = crossing(-i, in, last_in);
    if (outside && inside && -*inside <= *outside) outside = inside;
    if (!outside) outside = inside;
    if (outside) return std::abs(*outside) <= search_px ? outside : std::nullopt;
    last_out = out;
    last_in = in;
  }
  return std::nullopt;
}

}  // namespace bodyschema
