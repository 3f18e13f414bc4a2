#include "bodyschema/outline/odd_pieces.hpp"

#include <algorithm>
#include <cmath>

namespace bodyschema {
namespace {

// How often an edge is found where the robot's is, and where something else hides it.
constexpr double kFound = 0.985, kFoundOdd = 0.5;
// Share of outlines that something else hides, before a picture.
constexpr double kOdd = 0.1;
// One sample alone does not decide: log odds.
constexpr double kMostEvidence = 4.0;
// How much more likely neighbours are alike than not: log odds, each of some four.
constexpr double kAlike = 1.2;
// In samples: how far apart neighbours are, and the cosine between their normals.
constexpr double kReach = 2.2, kSameSide = 0.5;
constexpr int kSweeps = 8;

/// Log odds of "something else" against "the robot's edge".
double log_odds(const std::optional<double>& residual_px, double sd_px, double search_px) {
  if (!residual_px) return std::log((1.0 - kFoundOdd) / (1.0 - kFound));
  const double z = *residual_px / sd_px;
  const double edge = std::log(kFound / (sd_px * std::sqrt(2.0 * 3.14159265358979))) - 0.5 * z * z;
  return std::log(kFoundOdd / (2.0 * search_px)) - edge;
}

}  // namespace

void OddPieces::find_neighbours(std::span<const OutlineSample> samples, double reach_px) {
  // By rows: whatever is near in the picture is near in this order, up to a band of `reach_px`.
  in_order_.clear();
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (!samples[i].covered) in_order_.push_back(static_cast<std::uint32_t>(i));
  }
  std::sort(in_order_.begin(), in_order_.end(), [&](std::uint32_t a, std::uint32_t b) {
    return samples[a].pixel.y() != samples[b].pixel.y() ? samples[a].pixel.y() < samples[b].pixel.y() : a < b;
  });
  lists_.resize(std::max(lists_.size(), samples.size()));
  for (std::size_t i = 0; i < samples.size(); ++i) lists_[i].clear();
  for (std::size_t i = 0; i < in_order_.size(); ++i) {
    const auto& a = samples[in_order_[i]];
    for (std::size_t j = i + 1; j < in_order_.size(); ++j) {
      const auto& b = samples[in_order_[j]];
      if (b.pixel.y() - a.pixel.y() > reach_px) break;
      if ((a.pixel - b.pixel).squaredNorm() > reach_px * reach_px || a.normal.dot(b.normal) < kSameSide) continue;
      lists_[in_order_[i]].push_back(in_order_[j]);
      lists_[in_order_[j]].push_back(in_order_[i]);
    }
  }
}

void OddPieces::find(std::span<OutlineSample> samples, double sd_px, double spacing_px, double search_px) {
  find_neighbours(samples, kReach * spacing_px);
  evidence_.resize(samples.size());
  belief_.resize(samples.size());
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double own = log_odds(samples[i].residual_px, sd_px, search_px);
    evidence_[i] = std::log(kOdd / (1.0 - kOdd)) + std::clamp(own, -kMostEvidence, kMostEvidence);
    belief_[i] = std::tanh(0.5 * own);  // what neighbours say first is what they saw, not what is usual
  }
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    for (const auto i : in_order_) {
      double field = evidence_[i];
      for (const auto j : lists_[i]) field += kAlike * belief_[j];
      belief_[i] = std::tanh(0.5 * field);
    }
  }
  for (const auto i : in_order_) samples[i].odd = belief_[i] > 0.0;
}

}  // namespace bodyschema
