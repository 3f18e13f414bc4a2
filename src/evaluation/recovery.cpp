#include "recovery.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace bodyschema {

Recovery recovery(const std::vector<FrameRecord>& frames, std::size_t event, std::size_t camera) {
  // 99.9 % of a normal distribution in three dimensions lies nearer: chi-square, three degrees of freedom.
  const double region_sd = std::sqrt(16.266);
  Recovery result;
  double until = 0.0;
  for (std::size_t i = event; i < frames.size(); ++i) {
    const double error_mm = frames[i].position_mm[camera];
    if (error_mm < 0.0) continue;
    if (error_mm >= 1.0) {
      until = static_cast<double>(i - event + 1);
      result.frames.reset();
    } else {
      result.frames = until;
    }
    if (frames[i].position_sd[camera] > region_sd) ++result.frames_outside_999;
  }
  return result;
}

RecoveryFigures figures_of(const std::vector<Recovery>& recoveries) {
  constexpr double kNever = std::numeric_limits<double>::infinity();
  RecoveryFigures figures;
  figures.trials = recoveries.size();
  std::vector<double> recovered, outside;
  double longest = -1.0;
  for (std::size_t i = 0; i < recoveries.size(); ++i) {
    const auto& frames = recoveries[i].frames;
    if (frames) recovered.push_back(*frames);
    outside.push_back(recoveries[i].frames_outside_999);
    if (frames.value_or(kNever) <= longest) continue;
    longest = frames.value_or(kNever);
    figures.slowest = i;
  }
  figures.never = figures.trials - recovered.size();
  figures.frames_to_recover = Statistics::of(recovered);
  figures.frames_outside_999 = Statistics::of(outside);
  return figures;
}

Json to_json(const RecoveryFigures& f) {
  Json frames = nullptr;
  if (f.never < f.trials) frames = {{"mean", f.frames_to_recover.mean}, {"max", f.frames_to_recover.worst}};
  return {{"trials", f.trials},
          {"recovered", f.never == 0},
          {"never_recovered", f.never},
          {"frames_to_recover", frames},
          {"frames_outside_999", {{"mean", f.frames_outside_999.mean}, {"max", f.frames_outside_999.worst}}}};
}

std::string describe(const RecoveryFigures& f, std::uint64_t first_seed) {
  std::string text = "below 1 mm ";
  if (f.never > 0) text += fmt::format("never in {} of {} trials", f.never, f.trials);
  if (f.never > 0 && f.never < f.trials) text += ", else ";
  if (f.never < f.trials) {
    text += fmt::format("within {:>3.0f} frames (mean {:.1f})", f.frames_to_recover.worst, f.frames_to_recover.mean);
  }
  return text +
         fmt::format(", slowest seed {}, outside 99.9 %: {:.0f}", first_seed + f.slowest, f.frames_outside_999.worst);
}

}  // namespace bodyschema
