#include "bodyschema/evidence/outline_distance.hpp"

#include <cmath>
#include <utility>
#include <vector>

#include "bodyschema/core/order_statistics.hpp"

namespace bodyschema {

double median_outline_distance_px(LogFit& fit, const ErrorModel& model, std::span<const std::size_t> pictures) {
  constexpr double kReach_px = 30.0, kSpacing_px = 3.0, kNoneIsOutlier_px = 1e6;
  const auto& log = fit.log();
  std::vector<std::vector<double>> own(log.pictures().size());
  const auto at = fit.linearise(model, {}, {kReach_px, kSpacing_px, kNoneIsOutlier_px}, pictures,
                                [&](std::size_t p, std::span<const OutlinePoint> points) {
                                  for (const auto& point : points) own[p].push_back(std::abs(point.residual_px));
                                });
  std::vector<double> all;
  for (std::size_t p = 0; p < own.size(); ++p) {
    const double unit = log.unit_px(p);
    own[p].resize(static_cast<std::size_t>(at.evidence[p].sampled), kReach_px * unit);
    all.insert(all.end(), own[p].begin(), own[p].end());
  }
  return median(std::move(all));
}

}  // namespace bodyschema
