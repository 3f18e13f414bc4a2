#include <spdlog/fmt/fmt.h>

#include <cmath>

#include "experiments.hpp"
#include "trial_runner.hpp"

namespace bodyschema {
namespace {

constexpr double kRange_deg = 15.0;
constexpr double kStep_deg = 0.1;  // the paper's

/// Likelihood over the offset of the last joint, one arm posture.
struct Sweep {
  std::string posture;
  std::vector<double> error_deg;  ///< of the swept offset
  std::vector<double> likelihood;

  [[nodiscard]] double peak_deg() const {
    const auto best = std::max_element(likelihood.begin(), likelihood.end()) - likelihood.begin();
    return error_deg[static_cast<std::size_t>(best)];
  }
  /// Local maxima that stand out by more than a hundredth.
  [[nodiscard]] int maxima() const {
    constexpr double kProminence = 0.01;
    int count = 0;
    bool rising = true;
    double extreme = likelihood.front();
    for (const double value : likelihood) {
      if (rising ? value > extreme : value < extreme) extreme = value;
      if (std::abs(value - extreme) < kProminence) continue;
      count += rising ? 1 : 0;
      rising = !rising;
      extreme = value;
    }
    return count;
  }
};

}  // namespace

void run_likelihood(ExperimentContext& context) {
  // All other offsets at their true values, as in the paper's Fig. 2; the truth is known to the one
  // who draws the figure, never to the estimator.
  std::vector<Sweep> sweeps;
  TrialSetting setting = standard_setting(context);
  const int last = setting.plan.frames - 1;
  setting.on_frame = [&](Estimator& estimator, const Observation& observation, const TrialRecord& trial, int frame) {
    if (frame != 0 && frame != last) return;
    const Eigen::Index joints = trial.true_offset_deg.size();
    const int steps = static_cast<int>(std::lround(2.0 * kRange_deg / kStep_deg)) + 1;
    Eigen::MatrixXd offsets(joints, steps);
    Sweep sweep{frame == 0 ? "beginning of a reach" : "end of a reach", {}, {}};
    for (int i = 0; i < steps; ++i) {
      const double error = -kRange_deg + i * kStep_deg;
      offsets.col(i) = trial.true_offset_deg;
      offsets(joints - 1, i) += error;
      sweep.error_deg.push_back(error);
    }
    const Eigen::VectorXd likelihood = estimator.likelihood(observation, offsets * (kPi / 180.0));
    sweep.likelihood.assign(likelihood.begin(), likelihood.end());
    sweeps.push_back(std::move(sweep));
  };
  const std::vector<Contestant> contestants = {{"paper.stereo", options_for(context, "paper"), false}};
  const auto records = run_trials(
      context, "likelihood over one offset", 1, [&](std::uint64_t) { return setting; }, contestants);

  const std::string joint = RobotSetup::from(context.simulated.section("robot")).estimated_joints.back();
  Chart chart;
  chart.title = "Likelihood 1 - d over the offset of " + joint + ", all others true (Fig. 2)";
  chart.x_label = "error of the offset, deg";
  chart.y_label = "likelihood";
  context.table += fmt::format("\nlikelihood over the offset of {} (Fig. 2)\n", joint);
  for (const auto& sweep : sweeps) {
    chart.series.push_back({sweep.posture, sweep.error_deg, sweep.likelihood});
    context.table += fmt::format("{:<38} largest {:.1f} deg from the truth, maxima: {}\n", sweep.posture,
                                 sweep.peak_deg(), sweep.maxima());
    context.summary["likelihood"][sweep.posture == sweeps.front().posture ? "begin" : "end"] = {
        {"peak_error_deg", sweep.peak_deg()}, {"maxima", sweep.maxima()}};
  }
  context.report.heading("Likelihood over one offset");
  context.report.chart(chart);
}

}  // namespace bodyschema
