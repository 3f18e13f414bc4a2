#include <spdlog/fmt/fmt.h>

#include <Eigen/QR>

#include "bodyschema/evaluation/statistics.hpp"
#include "experiments.hpp"
#include "reach_figures.hpp"
#include "trial_runner.hpp"

namespace bodyschema {
namespace {

/// The arm moves from where it is until the corrected model sees the hand at `target_C` in the left
/// eye: least change of the joints, by Newton steps. Encoder readings, radians.
Eigen::VectorXd correct_reach(Estimator& estimator, const std::vector<Eigen::Index>& joints, Eigen::VectorXd q,
                              const Eigen::Vector3d& target_C) {
  constexpr double kStep = 1e-5;
  Eigen::Matrix<double, 3, Eigen::Dynamic> J(3, static_cast<Eigen::Index>(joints.size()));
  for (int iteration = 0; iteration < 15; ++iteration) {
    const Eigen::Vector3d hand = estimator.hand_pose(estimator.at_rest(q, 0), true).translation();
    for (std::size_t k = 0; k < joints.size(); ++k) {
      Eigen::VectorXd moved = q;
      moved(joints[k]) += kStep;
      J.col(static_cast<Eigen::Index>(k)) =
          (estimator.hand_pose(estimator.at_rest(moved, 0), true).translation() - hand) / kStep;
    }
    const Eigen::VectorXd step = J.completeOrthogonalDecomposition().solve(target_C - hand);
    for (std::size_t k = 0; k < joints.size(); ++k) q(joints[k]) += step(static_cast<Eigen::Index>(k));
  }
  return q;
}

}  // namespace

void run_reach(ExperimentContext& context) {
  // The ballistic reach ends where the nominal model believes the target to be; what it missed by is
  // the nominal figure. Then the arm corrects once, with what was learned on the way.
  const std::vector<Contestant> contestants = stereo_contestants(context);
  const RobotSetup setup = RobotSetup::from(context.simulated.section("robot"));
  TrialSetting reach = standard_setting(context);
  reach.on_end = [names = setup.estimated_joints](Estimator& estimator, const RobotModel& robot,
                                                  const Eigen::VectorXd& q, TrialRecord& trial,
                                                  std::size_t contestant) {
    std::vector<Eigen::Index> joints;
    for (const auto& name : names) joints.push_back(robot.joint_index(name));
    const Eigen::Vector3d target_C = estimator.hand_pose(estimator.at_rest(q, 0), false).translation();
    Eigen::VectorXd q_true = correct_reach(estimator, joints, q, target_C);
    for (std::size_t k = 0; k < joints.size(); ++k) {
      q_true(joints[k]) -= radians(trial.true_offset_deg(static_cast<Eigen::Index>(k)));
    }
    trial.contestants[contestant].reach_miss_mm =
        1e3 * (estimator.hand_pose(estimator.at_rest(q_true, 0), false).translation() - target_C).norm();
  };
  const auto records = run_trials(
      context, "reach to a target", context.options.trials, [&](std::uint64_t) { return reach; }, contestants);
  std::vector<double> nominal_mm;
  for (const auto& record : records) {
    nominal_mm.push_back(record.contestants[0].frames.back().nominal_mm[kLeft]);
  }
  const double nominal = Statistics::of(nominal_mm).median;
  context.table += fmt::format("\nreach to a target ({} trials), hand to target, median: nominal model {:.1f} mm",
                               records.size(), nominal);
  for (std::size_t i = 0; i < contestants.size(); ++i) {
    std::vector<double> corrected_mm;
    for (const auto& record : records) corrected_mm.push_back(record.contestants[i].reach_miss_mm);
    const double median = Statistics::of(corrected_mm).median;
    context.summary[modes()[i]]["reach"] = {
        {"trials", records.size()}, {"median_mm", median}, {"improvement", nominal / std::max(median, 1e-9)}};
    context.table += fmt::format(", {} {:.2f} mm", modes()[i], median);
  }
  context.table += '\n';
}

}  // namespace bodyschema
