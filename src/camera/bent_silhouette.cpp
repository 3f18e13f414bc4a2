#include "bodyschema/camera/bent_silhouette.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace bodyschema {
namespace {

struct Corner {
  double x, y;  ///< of the picture's furthest one, metres at a distance of one
};

Corner furthest_corner(const PinholeIntrinsics& k) {
  return {std::max(k.cx, k.width - 1 - k.cx) / k.fx, std::max(k.cy, k.height - 1 - k.cy) / k.fy};
}

/// How far the lens moves the picture's furthest corner, px.
double furthest_px(const PinholeIntrinsics& k, double k1) {
  const auto [x, y] = furthest_corner(k);
  const double r = std::hypot(x, y);
  return std::abs(k1) * r * r * r * std::max(k.fx, k.fy);
}

/// Where pixels of the bent picture lie in the straight one.
class Straight {
 public:
  Straight(const PinholeIntrinsics& k, double k1) : k_(k) {
    constexpr int kIterations = 5;  // each leaves a fifth or less of the error, up to |k1| r^2 = 0.2
    const auto [x, y] = furthest_corner(k);
    per_r2_ = kSteps / std::max(x * x + y * y, 1e-9);
    for (std::size_t i = 0; i < scale_.size(); ++i) {
      const double r2 = static_cast<double>(i) / per_r2_;
      double s = 1.0;
      for (int round = 0; round < kIterations; ++round) s = 1.0 / (1.0 + k1 * r2 * s * s);
      scale_[i] = s;
    }
  }
  struct Pixel {
    int u, v;
  };
  [[nodiscard]] Pixel of(int u, int v) const {
    const double x = (u - k_.cx) / k_.fx, y = (v - k_.cy) / k_.fy;
    const double at = (x * x + y * y) * per_r2_;
    const auto i = std::min(static_cast<std::size_t>(at), kSteps);
    // Between the steps it is straight to far less than a pixel.
    const double s = scale_[i] + (at - static_cast<double>(i)) * (scale_[i + 1] - scale_[i]);
    return {rounded(k_.fx * x * s + k_.cx), rounded(k_.fy * y * s + k_.cy)};
  }

 private:
  static int rounded(double x) { return static_cast<int>(std::floor(std::clamp(x, -1e6, 1e6) + 0.5)); }
  static constexpr std::size_t kSteps = 1024;
  PinholeIntrinsics k_;
  double per_r2_ = 0.0;
  std::array<double, kSteps + 2> scale_{};  ///< by the square of the distance from the middle
};

enum class Content { kNothing, kAll, kBoth };

/// What a mask has in a rectangle, bounds inclusive; nothing is beyond its border.
Content content(const BinaryMask& mask, int u0, int v0, int u1, int v1) {
  const bool cut = u0 < 0 || v0 < 0 || u1 >= mask.width() || v1 >= mask.height();
  u0 = std::max(u0, 0), v0 = std::max(v0, 0);
  u1 = std::min(u1, mask.width() - 1), v1 = std::min(v1, mask.height() - 1);
  if (u0 > u1 || v0 > v1) return Content::kNothing;
  bool any = false, all = !cut;
  for (int v = v0; v <= v1; ++v) {
    for (int w = u0 >> 6; w <= u1 >> 6; ++w) {
      std::uint64_t asked = ~std::uint64_t{0};
      if (w == u0 >> 6) asked <<= (u0 & 63);
      if (w == u1 >> 6) asked &= ~std::uint64_t{0} >> (63 - (u1 & 63));
      const std::uint64_t here = mask.row(v)[w] & asked;
      any = any || here != 0;
      all = all && here == asked;
      if (any && !all) return Content::kBoth;
    }
  }
  return any ? Content::kAll : Content::kNothing;
}

}  // namespace

BinaryMask bent_silhouette(BinaryMask straight, const PinholeIntrinsics& k, double k1) {
  constexpr double kSame_px = 0.5;
  if (furthest_px(k, k1) < kSame_px) return straight;
  constexpr int kCurved_px = 3;  // 64 pixels of a row lie on a line, but for this
  const Straight source(k, k1);
  BinaryMask result(straight.width(), straight.height());
  for (int v = 0; v < straight.height(); ++v) {
    for (int w = 0; w < straight.words_per_row(); ++w) {
      // Only where an outline passes is each pixel asked for by itself.
      const int begin = 64 * w, end = std::min(begin + 64, straight.width());
      const auto a = source.of(begin, v), b = source.of(end - 1, v);
      const auto [u0, u1] = std::minmax(a.u, b.u);
      const auto [v0, v1] = std::minmax(a.v, b.v);
      const Content here = content(straight, u0 - kCurved_px, v0 - kCurved_px, u1 + kCurved_px, v1 + kCurved_px);
      std::uint64_t word = here == Content::kAll ? ~std::uint64_t{0} >> (63 - (end - 1 - begin)) : 0;
      for (int u = begin; here == Content::kBoth && u < end; ++u) {
        const auto at = source.of(u, v);
        const bool inside = at.u >= 0 && at.v >= 0 && at.u < straight.width() && at.v < straight.height();
        word |= static_cast<std::uint64_t>(inside && straight.at(at.u, at.v)) << (u - begin);
      }
      result.row(v)[w] = word;
    }
  }
  return result;
}

}  // namespace bodyschema
