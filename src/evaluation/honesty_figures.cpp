#include "honesty_figures.hpp"

#include <algorithm>
#include <cmath>

#include "bodyschema/evaluation/statistics.hpp"

namespace bodyschema {
namespace {

constexpr double kHand_sd = 3.0, kHand_mm = 2.0, kOffset_sd = 5.0;
constexpr double kInterval95_sd = 1.96;
constexpr std::size_t kSoon = 45;

/// A share; of nothing it is what nobody can complain of.
struct Share {
  std::size_t of = 0, some = 0;
  void count(bool one) {
    ++of;
    some += one ? 1 : 0;
  }
  [[nodiscard]] double rate(double of_nothing) const {
    return of > 0 ? static_cast<double>(some) / static_cast<double>(of) : of_nothing;
  }
};

}  // namespace

bool HonestyFrame::wrong() const {
  if (hand_error_mm && *hand_error_mm > kHand_mm && *hand_error_mm > kHand_sd * hand_sd_mm) return true;
  return (offset_error_deg.cwiseAbs().array() > kOffset_sd * offset_sd_deg.array()).any();
}

HonestyFigures honesty_figures(const std::vector<const HonestyLog*>& logs) {
  Share dishonest_frames, dishonest_logs, intervals, unconverged, published, converged, soon;
  std::vector<double> sd_to_error, half_widths;
  for (const auto* log : logs) {
    bool wrong_once = false, converged_soon = false;
    for (std::size_t i = 0; i < log->size(); ++i) {
      const auto& frame = (*log)[i];
      converged.count(frame.converged);
      if (frame.in_view) published.count(frame.hand_sd_mm > 0.0 && std::isfinite(frame.hand_sd_mm));
      if (!frame.converged) {
        if (frame.in_view && frame.hand_error_mm) {
          unconverged.count(*frame.hand_error_mm <= kHand_sd * frame.hand_sd_mm);
        }
        continue;
      }
      const bool wrong = frame.wrong();
      dishonest_frames.count(wrong);
      wrong_once = wrong_once || wrong;
      converged_soon = converged_soon || i < kSoon;
      for (Eigen::Index k = 0; k < frame.offset_error_deg.size(); ++k) {
        intervals.count(std::abs(frame.offset_error_deg[k]) <= kInterval95_sd * frame.offset_sd_deg[k]);
      }
      if (frame.hand_error_mm) sd_to_error.push_back(frame.hand_sd_mm / std::max(1e-6, *frame.hand_error_mm));
    }
    dishonest_logs.count(wrong_once);
    soon.count(converged_soon);
    if (log->empty()) continue;
    for (const double sd : log->back().offset_sd_deg) half_widths.push_back(kInterval95_sd * sd);
  }
  HonestyFigures f;
  f.logs = logs.size();
  f.dishonest_frame_rate = dishonest_frames.rate(0.0);
  f.dishonest_log_rate = dishonest_logs.rate(0.0);
  f.coverage95 = intervals.rate(1.0);
  f.unconverged_hand_coverage = unconverged.rate(1.0);
  f.hand_sd_published_rate = published.rate(1.0);
  f.converged_rate = converged.rate(0.0);
  f.converged_within_45_rate = soon.rate(0.0);
  f.sd_to_error_median = Statistics::of(sd_to_error).median;
  f.half_width95_median_deg = Statistics::of(half_widths).median;
  return f;
}

Json to_json(const HonestyFigures& f) {
  return {{"logs", f.logs},
          {"dishonest_frame_rate", f.dishonest_frame_rate},
          {"dishonest_log_rate", f.dishonest_log_rate},
          {"coverage95", f.coverage95},
          {"unconverged_hand_coverage", f.unconverged_hand_coverage},
          {"hand_sd_published_rate", f.hand_sd_published_rate},
          {"converged_rate", f.converged_rate},
          {"converged_within_45_rate", f.converged_within_45_rate},
          {"sd_to_error_median", f.sd_to_error_median},
          {"half_width95_median_deg", f.half_width95_median_deg}};
}

HonestyLog honesty_log(const TrialRecord& trial, std::size_t contestant) {
  HonestyLog log;
  for (const auto& record : trial.contestants[contestant].frames) {
    HonestyFrame frame;
    frame.converged = record.state == EstimatorState::kConverged;
    frame.in_view = record.visible_share > 0.0;
    if (record.position_mm[0] >= 0.0) frame.hand_error_mm = record.position_mm[0];
    frame.hand_sd_mm = record.hand_sd_mm;
    frame.offset_error_deg = record.offset_deg - trial.true_offset_deg;
    frame.offset_sd_deg = record.covariance_deg2.diagonal().cwiseMax(0.0).cwiseSqrt();
    log.push_back(std::move(frame));
  }
  return log;
}

}  // namespace bodyschema
