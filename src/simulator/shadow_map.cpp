#include "bodyschema/simulator/shadow_map.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace bodyschema::simulator {
namespace {

constexpr float kNothing = -1e9f;
/// A surface does not shade itself: what lies less than this above it is taken for itself.
constexpr float kBias_m = 0.005f;
constexpr float kWidest_m = 0.03f;  // of a half shadow
constexpr int kBlock = 8;           // texels

/// Points spread evenly over a disc of radius 1 (sunflower).
template <std::size_t N>
std::array<Eigen::Vector2f, N> disc() {
  std::array<Eigen::Vector2f, N> points;
  for (std::size_t i = 0; i < N; ++i) {
    const double radius = std::sqrt((static_cast<double>(i) + 0.5) / static_cast<double>(N));
    const double angle = 2.39996322972865332 * static_cast<double>(i);
    points[i] = {static_cast<float>(radius * std::cos(angle)), static_cast<float>(radius * std::sin(angle))};
  }
  return points;
}

}  // namespace

ShadowMap::ShadowMap(std::vector<const TriangleMesh*> meshes, const Eigen::Vector3d& to_lamp_W, double lamp_size_rad)
    : meshes_(std::move(meshes)), half_lamp_(static_cast<float>(0.5 * lamp_size_rad)) {
  const Eigen::Vector3f z = to_lamp_W.normalized().cast<float>();
  const Eigen::Vector3f x = z.unitOrthogonal();
  R_LW_.row(0) = x;
  R_LW_.row(1) = z.cross(x);
  R_LW_.row(2) = z;
  std::size_t points = 0;
  for (const auto* mesh : meshes_) {
    first_point_.push_back(points);
    points += mesh->vertices.size();
  }
  points_.resize(points);
}

void ShadowMap::draw(std::span<const Eigen::Isometry3f> X_WB, std::span<const char> hidden) {
  constexpr float kHuge = std::numeric_limits<float>::max();
  Eigen::Vector2f low(kHuge, kHuge), high(-kHuge, -kHuge);
  const auto there = [&](std::size_t m) { return hidden.empty() || hidden[m] == 0; };
  for (std::size_t m = 0; m < meshes_.size(); ++m) {
    if (!there(m)) continue;
    const Eigen::Matrix3f R = R_LW_ * X_WB[m].linear();
    const Eigen::Vector3f t = R_LW_ * X_WB[m].translation();
    for (std::size_t i = 0; i < meshes_[m]->vertices.size(); ++i) {
      Eigen::Vector3f& p = points_[first_point_[m] + i];
      p = R * meshes_[m]->vertices[i] + t;
      low = low.cwiseMin(p.head<2>());
      high = high.cwiseMax(p.head<2>());
    }
  }
  height_.assign(static_cast<std::size_t>(kSize) * kSize, kNothing);
  if (!(high.x() >= low.x())) {
    a0_ = b0_ = kHuge;  // nothing casts a shadow
    texel_ = 1.0f;
    block_per_m_ = 0.0f;
    return;
  }
  texel_ = std::max(1e-4f, (high - low).maxCoeff() / static_cast<float>(kSize - 2));
  a0_ = low.x() - texel_;
  b0_ = low.y() - texel_;
  const float per_m = 1.0f / texel_;
  for (std::size_t m = 0; m < meshes_.size(); ++m) {
    if (!there(m)) continue;
    const Eigen::Vector3f* const points = points_.data() + first_point_[m];
    for (const auto& t : meshes_[m]->triangles) {
      // Texel (i, j) is the point ((i + 0.5), (j + 0.5)) texels from the corner.
      std::array<Eigen::Vector3f, 3> p;
      for (std::size_t k = 0; k < 3; ++k) {
        const Eigen::Vector3f& q = points[t[k]];
        p[k] = {(q.x() - a0_) * per_m - 0.5f, (q.y() - b0_) * per_m - 0.5f, q.z()};
      }
      const float area = (p[1].x() - p[0].x()) * (p[2].y() - p[0].y()) - (p[2].x() - p[0].x()) * (p[1].y() - p[0].y());
      const float row_low = std::min({p[0].y(), p[1].y(), p[2].y()});
      const float row_high = std::max({p[0].y(), p[1].y(), p[2].y()});
      const int row0 = std::max(0, static_cast<int>(std::ceil(row_low)));
      const int row1 = std::min(kSize - 1, static_cast<int>(std::floor(row_high)));
      if (row0 > row1 || !(std::abs(area) > 1e-12f)) continue;
      const float inverse = 1.0f / area;
      const float gx =
          ((p[1].z() - p[0].z()) * (p[2].y() - p[0].y()) - (p[2].z() - p[0].z()) * (p[1].y() - p[0].y())) * inverse;
      const float gy =
          ((p[2].z() - p[0].z()) * (p[1].x() - p[0].x()) - (p[1].z() - p[0].z()) * (p[2].x() - p[0].x())) * inverse;
      for (int row = row0; row <= row1; ++row) {
        const auto y = static_cast<float>(row);
        float left = kHuge, right = -kHuge;
        for (std::size_t k = 0; k < 3; ++k) {
          const auto& a = p[k];
          const auto& b = p[(k + 1) % 3];
          if ((y < a.y()) == (y < b.y()) && y != a.y() && y != b.y()) continue;
          if (a.y() == b.y()) {
            left = std::min({left, a.x(), b.x()});
            right = std::max({right, a.x(), b.x()});
            continue;
          }
          const float x = a.x() + (y - a.y()) * (b.x() - a.x()) / (b.y() - a.y());
          left = std::min(left, x);
          right = std::max(right, x);
        }
        const int begin = std::max(0, static_cast<int>(std::ceil(left)));
        const int end = std::min(kSize - 1, static_cast<int>(std::floor(right)));
        float* const out = height_.data() + static_cast<std::size_t>(row) * kSize;
        for (int i = begin; i <= end; ++i) {
          const float z = p[0].z() + gx * (static_cast<float>(i) - p[0].x()) + gy * (y - p[0].y());
          out[i] = std::max(out[i], z);
        }
      }
    }
  }
  // For most points nothing is above anywhere near: one look at a coarse map tells.
  blocks_ = kSize / kBlock;
  block_per_m_ = 1.0f / (texel_ * static_cast<float>(kBlock));
  const auto block = [&](int i, int j) {
    return static_cast<std::size_t>(j) * static_cast<std::size_t>(blocks_) + static_cast<std::size_t>(i);
  };
  std::vector<float>& own = own_;
  own.assign(static_cast<std::size_t>(blocks_) * static_cast<std::size_t>(blocks_), kNothing);
  for (int j = 0; j < kSize; ++j) {
    for (int i = 0; i < kSize; ++i) {
      float& most = own[block(i / kBlock, j / kBlock)];
      most = std::max(most, height_[static_cast<std::size_t>(j) * kSize + static_cast<std::size_t>(i)]);
    }
  }
  const int reach = 1 + static_cast<int>(kWidest_m * block_per_m_);
  highest_.assign(own.size(), kNothing);
  across_.assign(own.size(), kNothing);
  for (int j = 0; j < blocks_; ++j) {
    for (int i = 0; i < blocks_; ++i) {
      for (int k = std::max(0, i - reach); k <= std::min(blocks_ - 1, i + reach); ++k) {
        across_[block(i, j)] = std::max(across_[block(i, j)], own[block(k, j)]);
      }
    }
  }
  for (int j = 0; j < blocks_; ++j) {
    for (int k = std::max(0, j - reach); k <= std::min(blocks_ - 1, j + reach); ++k) {
      for (int i = 0; i < blocks_; ++i) highest_[block(i, j)] = std::max(highest_[block(i, j)], across_[block(i, k)]);
    }
  }
}

float ShadowMap::lit(const Eigen::Vector3f& p_W, float cosine) const {
  static const auto search = disc<10>();
  static const auto look = disc<16>();
  const Eigen::Vector3f p = R_LW_ * p_W;
  const float side = static_cast<float>(kSize) * texel_;
  if (p.x() < a0_ - kWidest_m || p.y() < b0_ - kWidest_m || p.x() > a0_ + side + kWidest_m ||
      p.y() > b0_ + side + kWidest_m) {
    return 1.0f;
  }
  const int i = std::clamp(static_cast<int>((p.x() - a0_) * block_per_m_), 0, blocks_ - 1);
  const int j = std::clamp(static_cast<int>((p.y() - b0_) * block_per_m_), 0, blocks_ - 1);
  if (highest_[static_cast<std::size_t>(j) * static_cast<std::size_t>(blocks_) + static_cast<std::size_t>(i)] - p.z() <=
      kBias_m) {
    return 1.0f;
  }
  const float per_m = 1.0f / texel_;
  const float a = (p.x() - a0_) * per_m, b = (p.y() - b0_) * per_m;
  const auto above = [&](const Eigen::Vector2f& offset, float radius) {
    const float x = a + radius * offset.x(), y = b + radius * offset.y();
    constexpr auto kEnd = static_cast<float>(kSize);
    if (!(x >= 0.0f && y >= 0.0f && x < kEnd && y < kEnd)) return kNothing;
    return height_[static_cast<std::size_t>(static_cast<int>(y)) * kSize +
                   static_cast<std::size_t>(static_cast<int>(x))] -
           p.z();
  };
  // How high above the point is what hides the lamp? Half shadows are as wide as that times the lamp. The search
  // reaches to the side, where a slanting surface is higher.
  const float slope = std::sqrt(std::max(0.0f, 1.0f - cosine * cosine)) / std::max(0.1f, cosine);
  const auto bias = [&](float radius) { return kBias_m + slope * (0.7f * radius + 2.0f * texel_); };
  const float widest = bias(kWidest_m);
  float sum = 0.0f;
  int hidden = 0;
  for (const auto& offset : search) {
    const float height = above(offset, kWidest_m * per_m);
    if (height > widest) {
      sum += height;
      ++hidden;
    }
  }
  if (hidden == 0) return 1.0f;
  const float radius = std::clamp(half_lamp_ * sum / static_cast<float>(hidden), 0.7f * texel_, kWidest_m);
  const float own = bias(radius);
  int blocked = 0;
  for (const auto& offset : look) blocked += above(offset, radius * per_m) > own ? 1 : 0;
  return 1.0f - static_cast<float>(blocked) / static_cast<float>(look.size());
}

}  // namespace bodyschema::simulator
