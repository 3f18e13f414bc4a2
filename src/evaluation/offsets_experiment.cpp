#include <spdlog/fmt/fmt.h>

#include <cmath>
#include <random>

#include "bodyschema/evaluation/statistics.hpp"
#include "experiments.hpp"
#include "trial_runner.hpp"

namespace bodyschema {

void run_offsets(ExperimentContext& context) {
  const std::vector<Contestant> contestants = stereo_contestants(context);
  const auto records = run_trials(
      context, "offsets after 60 s of babbling", kOffsetLogs,
      [&](std::uint64_t seed) {
        TrialSetting setting = standard_setting(context);
        setting.plan.motion = simulator::Motion::kBabble;
        setting.plan.seconds = 60.0;
        std::mt19937_64 random(seed * 104729u + 11u);
        std::normal_distribution<double> normal(0.0, 4.0);
        for (auto& [joint, offset] : setting.plan.offsets_deg) offset = normal(random);
        return setting;
      },
      contestants);
  context.table += fmt::format("\noffsets after 60 s of babbling ({} trials)\n", kOffsetLogs);
  for (std::size_t i = 0; i < contestants.size(); ++i) {
    double squares = 0.0;
    int covered = 0;
    int n = 0;
    std::vector<double> half_widths;
    for (const auto& record : records) {
      const FrameRecord& last = record.contestants[i].frames.back();
      for (Eigen::Index k = 0; k < last.offset_deg.size(); ++k) {
        const double error = last.offset_deg(k) - record.true_offset_deg(k);
        const double half_width = 1.96 * std::sqrt(std::max(0.0, last.covariance_deg2(k, k)));
        squares += error * error;
        covered += std::abs(error) <= half_width ? 1 : 0;
        half_widths.push_back(half_width);
        ++n;
      }
    }
    const double rms = std::sqrt(squares / n);
    const double coverage = static_cast<double>(covered) / n;
    const double half_width = Statistics::of(half_widths).median;
    context.summary[modes()[i]]["offsets"] = {
        {"trials", kOffsetLogs}, {"rms_deg", rms}, {"coverage95", coverage}, {"half_width95_median_deg", half_width}};
    context.table += fmt::format("{:<38} rms {:.3f} deg, 95 % intervals cover {:.0f} %, median half-width {:.3f} deg\n",
                                 contestants[i].name, rms, 100.0 * coverage, half_width);
  }
  context.table += "weakest direction of the last log: " + records.back().contestants[0].weakest.text + '\n';
}

}  // namespace bodyschema
