#include "bodyschema/evidence/outline_noise.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "bodyschema/core/order_statistics.hpp"

namespace bodyschema {
namespace {

constexpr double kSameSide = 0.5;       // cosine between normals
constexpr double kScale_sd = 4.0;       // robust scale: 96 % of a Gaussian's efficiency
constexpr double kLeastScale_px = 1.0;  // a fraction of a pixel is what pictures place an outline to
constexpr double kMostScale_px = 4.0;   // what lies further off is something else
constexpr double kMedianToSd = 1.4826;  // of a Gaussian
constexpr std::size_t kFewest = 20;     // points
/// Physical: a flank of a limb at arm's length, in points 3 px apart: over so many light and shadow err alike.
constexpr double kFlankPoints = 12.0;

}  // namespace

void OutlineNoise::add(std::span<const OutlinePoint> points, double unit_px, double memory_pictures) {
  if (points.size() < kFewest) return;
  if (memory_pictures > 0.0) {
    const double kept = std::exp(-1.0 / memory_pictures);
    for (double* sum : {&pictures_, &points_, &median_square_, &psi_square_, &weight_, &slope_}) *sum *= kept;
    for (auto* sums : {&product_, &pairs_}) {
      for (double& sum : *sums) sum *= kept;
    }
  }
  std::vector<double> size;
  size.reserve(points.size());
  for (const auto& p : points) {
    const double r = p.residual_px / unit_px, psi = p.weight * r;
    size.push_back(std::abs(r));
    psi_square_ += psi * psi;
    weight_ += p.weight;
    // With w = c^4 / (r^2 + c^2)^2: d(w r)/dr = w (4 sqrt(w) - 3).
    slope_ += p.weight * (4.0 * std::sqrt(p.weight) - 3.0);
  }
  median_square_ += std::pow(kMedianToSd * median(std::move(size)), 2);
  points_ += static_cast<double>(points.size());
  pictures_ += 1.0;
  const double reach = kBin_px.back() * unit_px;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto& a = points[i];
    for (std::size_t j = i + 1; j < points.size(); ++j) {
      const auto& b = points[j];
      const Eigen::Vector2d d = a.pixel - b.pixel;
      const double square = d.squaredNorm();
      if (square >= reach * reach || a.normal.dot(b.normal) < kSameSide) continue;
      const double distance = std::sqrt(square) / unit_px;
      const auto bin =
          static_cast<std::size_t>(std::upper_bound(kBin_px.begin(), kBin_px.end() - 1, distance) - kBin_px.begin());
      product_[bin] += a.weight * a.residual_px * b.weight * b.residual_px / (unit_px * unit_px);
      pairs_[bin] += 1.0;
    }
  }
}

double OutlineNoise::sd_px() const {
  return std::sqrt((prior_.pictures * prior_.sd_px * prior_.sd_px + median_square_) / (prior_.pictures + pictures_));
}

double OutlineNoise::correlated_points() const {
  double own = prior_.correlated_points;
  if (psi_square_ > 0.0) {
    // Up to where they no longer are alike: further off, sums of products are but noise. Nearer than points are spaced
    // there are none.
    own = 1.0;
    for (std::size_t bin = 0; bin < kBins && (pairs_[bin] <= 0.0 || product_[bin] > 0.0); ++bin) {
      own += 2.0 * product_[bin] / psi_square_;
    }
  }
  return (prior_.pictures * prior_.correlated_points + pictures_ * own) / (prior_.pictures + pictures_);
}

double OutlineNoise::correlation_px() const {
  double from = 0.0;
  for (std::size_t bin = 0; bin < kBins; ++bin) {
    if (pairs_[bin] <= 0.0) continue;
    if (points_ <= 0.0 || product_[bin] / pairs_[bin] < 0.5 * psi_square_ / points_) break;
    from = kBin_px[bin];
  }
  return from;
}

double OutlineNoise::variance_px2() const {
  const double prior = prior_.sd_px * prior_.sd_px;
  double own = prior;
  if (points_ > 0.0 && slope_ > 0.0)
    own = (psi_square_ / points_) * (weight_ / points_) / std::pow(slope_ / points_, 2);
  return kFlankPoints * prior_.floor_px * prior_.floor_px +
         correlated_points() * (prior_.pictures * prior + pictures_ * own) / (prior_.pictures + pictures_);
}

double OutlineNoise::robust_px() const {
  return std::clamp(kScale_sd * sd_px(), kLeastScale_px, kMostScale_px);
}

double mean_variance_px2(std::span<const OutlineNoise> cameras) {
  double sum = 0.0;
  for (const auto& noise : cameras) sum += noise.variance_px2() / static_cast<double>(cameras.size());
  return sum;
}

double widest_robust_px(std::span<const OutlineNoise> cameras) {
  double robust_px = 0.0;
  for (const auto& noise : cameras) robust_px = std::max(robust_px, noise.robust_px());
  return robust_px;
}

}  // namespace bodyschema
