#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <opencv2/imgproc.hpp>
#include <random>
#include <string>
#include <vector>

#include "bodyschema/geometry/binary_mask.hpp"
#include "bodyschema/geometry/image.hpp"

namespace bodyschema::test {

/// A point of a known outline, px, with the unit normal that points out of the shape.
struct EdgePoint {
  double u, v, nu, nv;
};

/// A capsule (a finger) or, with equal ends, a disc: pixels within `radius` of a segment.
struct Capsule {
  double u0, v0, u1, v1, radius;
  /// Signed distance, negative inside; `depth01` is 0 on the axis and 1 on the outline.
  double distance(double u, double v) const {
    const double du = u1 - u0, dv = v1 - v0;
    const double length2 = du * du + dv * dv;
    const double t = length2 > 0 ? std::clamp(((u - u0) * du + (v - v0) * dv) / length2, 0.0, 1.0) : 0.0;
    return std::hypot(u - u0 - t * du, v - v0 - t * dv) - radius;
  }
};

enum class Texture { kPlain, kGradient, kClutter };

/// A small world with exact outlines, pictured by supersampling, blur and noise: independent of
/// the project's own rendering.
struct Scene {
  int width = 160;
  int height = 120;
  Texture texture = Texture::kPlain;
  double base[3] = {60, 90, 120};     ///< background colour, levels
  double robot[3] = {200, 190, 180};  ///< robot colour, levels
  double ambient = 1.0;               ///< 1: flat; less: Lambert, lit from the lamp
  double lamp[3] = {0, 0, 1};         ///< unit vector towards it: right, down, to the camera
  double rounding_px = 0;             ///< flat but for a rim as wide as this; 0: round all through
  double blur_px = 0.4;
  double noise_levels = 2.5;
  int channels = 3;
  int supersampling = 6;  ///< per pixel and axis
  double shift_u = 0;     ///< of the clutter, px: another place of the same room
  std::vector<Capsule> shapes;

  double distance(double u, double v) const {
    double nearest = 1e9;
    for (const auto& shape : shapes) nearest = std::min(nearest, shape.distance(u, v));
    return nearest;
  }
  void background_colour(double u, double v, double* colour) const {
    for (int c = 0; c < 3; ++c) colour[c] = base[c];
    if (texture == Texture::kGradient) {
      for (int c = 0; c < 3; ++c) colour[c] *= 0.85 + 0.3 * u / width - 0.1 * v / height;
    }
    if (texture == Texture::kClutter) {
      u += shift_u;
      // Tiles of random colour, 11 px wide, with stripes on some.
      const auto tile = static_cast<std::uint32_t>(std::floor(u / 11.0) + 100) * 7919u +
                        static_cast<std::uint32_t>(std::floor(v / 13.0) + 100) * 104729u;
      std::uint32_t state = tile * 2654435761u;
      for (int c = 0; c < 3; ++c) {
        state = state * 1664525u + 1013904223u;
        colour[c] = 20.0 + static_cast<double>(state >> 24) * 0.8;
      }
      if (state & (1u << 20)) {
        const double stripe = 25.0 * std::sin(u * 1.1 + v * 0.7);
        for (int c = 0; c < 3; ++c) colour[c] += stripe;
      }
    }
  }
  void robot_colour(double u, double v, double* colour) const {
    // The shape on top is the one whose axis is nearest in units of its radius.
    const Capsule* top = nullptr;
    double depth = 1.0;
    for (const auto& shape : shapes) {
      const double d = std::max(0.0, shape.distance(u, v) / shape.radius + 1.0);
      if (d < depth) {
        depth = d;
        top = &shape;
      }
    }
    double facing = lamp[2];
    if (top != nullptr) {
      if (rounding_px > 0) depth = std::max(0.0, 1.0 + top->distance(u, v) / rounding_px);
      constexpr double kStep = 1e-3;  // the slope of the distance is the normal's direction
      const double nu = (top->distance(u + kStep, v) - top->distance(u - kStep, v)) / (2 * kStep);
      const double nv = (top->distance(u, v + kStep) - top->distance(u, v - kStep)) / (2 * kStep);
      facing = lamp[0] * nu * depth + lamp[1] * nv * depth + lamp[2] * std::sqrt(std::max(0.0, 1.0 - depth * depth));
    }
    const double light = ambient + (1.0 - ambient) * std::max(0.0, facing);
    for (int c = 0; c < 3; ++c) colour[c] = robot[c] * light;
  }

  /// The noise-free picture, levels, RGB.
  cv::Mat ideal() const {
    const int sub = supersampling;
    const int pad = 2;
    cv::Mat fine((height + 2 * pad) * sub, (width + 2 * pad) * sub, CV_32FC3);
    for (int y = 0; y < fine.rows; ++y) {
      for (int x = 0; x < fine.cols; ++x) {
        const double u = (x + 0.5) / sub - 0.5 - pad;
        const double v = (y + 0.5) / sub - 0.5 - pad;
        double colour[3];
        if (distance(u, v) <= 0.0) {
          robot_colour(u, v, colour);
        } else {
          background_colour(u, v, colour);
        }
        fine.at<cv::Vec3f>(y, x) =
            cv::Vec3f(static_cast<float>(colour[0]), static_cast<float>(colour[1]), static_cast<float>(colour[2]));
      }
    }
    if (blur_px > 0) cv::GaussianBlur(fine, fine, cv::Size(0, 0), blur_px * sub);
    cv::Mat coarse;
    cv::resize(fine, coarse, cv::Size(width + 2 * pad, height + 2 * pad), 0, 0, cv::INTER_AREA);
    return coarse(cv::Rect(pad, pad, width, height)).clone();
  }
  Image picture(const cv::Mat& ideal_picture, std::mt19937& random) const {
    std::normal_distribution<double> noise(0.0, 1.0);
    Image image(width, height, channels);
    for (int v = 0; v < height; ++v) {
      for (int u = 0; u < width; ++u) {
        const auto& colour = ideal_picture.at<cv::Vec3f>(v, u);
        for (int c = 0; c < channels; ++c) {
          double level = static_cast<double>(colour[c]);
          if (channels == 1) level = (level + static_cast<double>(colour[1] + colour[2])) / 3.0;
          level += noise_levels * noise(random);
          image.pixel(u, v)[c] = static_cast<std::uint8_t>(std::clamp(std::lround(level), 0L, 255L));
        }
      }
    }
    return image;
  }
  Image picture(std::mt19937& random) const { return picture(ideal(), random); }
  Scene without_robot() const {
    Scene empty = *this;
    empty.shapes.clear();
    return empty;
  }
  /// Pixels whose centre is covered.
  BinaryMask true_mask() const {
    BinaryMask mask(width, height);
    for (int v = 0; v < height; ++v) {
      for (int u = 0; u < width; ++u) {
        if (distance(u, v) <= 0.0) mask.set(u, v);
      }
    }
    return mask;
  }
  /// Points of the outline of the union, about one per pixel, at least `margin` from the border.
  std::vector<EdgePoint> outline(double margin = 6.0) const {
    std::vector<EdgePoint> points;
    for (const auto& s : shapes) {
      const double du = s.u1 - s.u0, dv = s.v1 - s.v0;
      const double length = std::hypot(du, dv);
      const double angle = std::atan2(dv, du);
      const auto add = [&](double u, double v, double nu, double nv) {
        if (u < margin || v < margin || u > width - 1 - margin || v > height - 1 - margin) return;
        // Concave corners, where two shapes meet, have no normal.
        if (distance(u + 4.0 * nu, v + 4.0 * nv) < 3.9) return;
        if (distance(u, v) > -1e-9) points.push_back({u, v, nu, nv});
      };
      const int around = static_cast<int>(2 * M_PI * s.radius) + 4;
      for (int i = 0; i < around; ++i) {
        const double a = 2 * M_PI * i / around;
        const bool at_end = std::cos(a - angle) > 0;
        const double cu = at_end ? s.u1 : s.u0, cv = at_end ? s.v1 : s.v0;
        add(cu + s.radius * std::cos(a), cv + s.radius * std::sin(a), std::cos(a), std::sin(a));
      }
      for (double t = 0.5; t < length; t += 1.0) {
        for (const int side : {-1, 1}) {
          const double nu = -dv / length * side, nv = du / length * side;
          add(s.u0 + du * t / length + s.radius * nu, s.v0 + dv * t / length + s.radius * nv, nu, nv);
        }
      }
    }
    return points;
  }
};

/// Where the coverage passes one half along the normal, px from the point (positive: outside);
/// false when it does not or meets an invalid pixel on the way.
inline bool half_crossing(const EdgePoint& point, int width, int height, const std::vector<std::uint8_t>& coverage,
                          const BinaryMask& valid, double& offset) {
  const auto at = [&](double u, double v, double& value) {
    const int iu = static_cast<int>(std::floor(u)), iv = static_cast<int>(std::floor(v));
    if (iu < 0 || iv < 0 || iu + 1 >= width || iv + 1 >= height) return false;
    const double fu = u - iu, fv = v - iv;
    value = 0.0;
    for (int b = 0; b < 2; ++b) {
      for (int a = 0; a < 2; ++a) {
        if (!valid.empty() && !valid.at(iu + a, iv + b)) return false;
        value += (a ? fu : 1 - fu) * (b ? fv : 1 - fv) * coverage[static_cast<std::size_t>((iv + b) * width + iu + a)] /
                 255.0;
      }
    }
    return true;
  };
  double before = 1.0;
  constexpr double kStep = 0.05;
  for (double t = -2.5; t <= 2.5; t += kStep) {
    double value = 0.0;
    if (!at(point.u + t * point.nu, point.v + t * point.nv, value)) return false;
    if (before >= 0.5 && value < 0.5) {
      if (t == -2.5) return false;
      offset = t - kStep * (0.5 - value) / (before - value);
      return true;
    }
    before = value;
  }
  return false;
}

struct EdgeStatistics {
  double bias = 0.0;
  double sd = 0.0;
  double found = 0.0;  ///< share of points whose edge was found
  double worst = 0.0;
};

inline EdgeStatistics edge_statistics(const std::vector<EdgePoint>& points, int width, int height,
                                      const std::vector<std::uint8_t>& coverage, const BinaryMask& valid) {
  EdgeStatistics result;
  double sum = 0.0, squares = 0.0;
  int n = 0;
  for (const auto& point : points) {
    double offset = 0.0;
    if (!half_crossing(point, width, height, coverage, valid, offset)) continue;
    sum += offset;
    squares += offset * offset;
    result.worst = std::max(result.worst, std::abs(offset));
    ++n;
  }
  if (n > 1) {
    result.bias = sum / n;
    result.sd = std::sqrt(std::max(0.0, (squares - sum * sum / n) / (n - 1)));
  }
  result.found = points.empty() ? 0.0 : static_cast<double>(n) / static_cast<double>(points.size());
  return result;
}

/// A hand-like set of shapes: palm and fingers of 5 to 7 px radius.
inline std::vector<Capsule> hand(double u, double v) {
  return {{u, v, u, v, 19.0},
          {u - 12, v - 10, u - 26, v - 38, 5.0},
          {u - 4, v - 14, u - 7, v - 46, 5.5},
          {u + 6, v - 13, u + 11, v - 45, 5.5},
          {u + 15, v - 5, u + 36, v - 22, 6.5},
          {u - 2, v + 10, u + 8, v + 60, 13.0}};
}

}  // namespace bodyschema::test
