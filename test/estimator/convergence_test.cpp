#include "convergence.hpp"

#include <gmock/gmock.h>

#include "outline/own_robot.hpp"

namespace bodyschema {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

/// An arm that is known as well as asked for, in a frame that shows it.
class ConvergenceOfOwnRobot : public OwnRobot {
 protected:
  ConvergenceOfOwnRobot() {
    outcome_.state = EstimatorState::kConverging;
    outcome_.near = true;
    outcome_.verdict = FrameVerdict::kAgrees;
    estimate_.hand_sd_m = 1e-3;
    estimate_.hand_sd_limit_m = 2e-3;
  }
  /// @param links_m  what postures say of the link's length
  void see(int postures, double links_m = 0.0) {
    const auto n = state_.size();
    const Eigen::VectorXd precision = known_.memory.layout().prior_sd.array().square().inverse() * 1e4;
    Eigen::VectorXd x = Eigen::VectorXd::Zero(n);
    x[n - 1] = links_m;
    for (int i = 0; i < postures; ++i) {
      const Eigen::VectorXd q = Eigen::VectorXd::Constant(n, 0.3 * i);
      known_.memory.add(i, q, {precision.asDiagonal(), precision.cwiseProduct(x)}, x);
    }
  }
  EstimatorState concluded(bool knows_shape = true) {
    return conclude(outcome_, known_, state_, knows_shape, estimate_);
  }

  static constexpr double kLink_m = 0.002;
  State state_{JointRoles::of(robot_, setup_, rig_),
               {{"joint_offset", {"r_elbow", ""}, {radians(5.0)}}, {"link_length", {"r_elbow", ""}, {kLink_m}}}};
  FusedState known_{state_, {state_.prior_mean(), state_.prior_sd(), {true, false}, {}}, {}, 3};
  FrameOutcome outcome_;
  Estimate estimate_;
};

TEST_F(ConvergenceOfOwnRobot, NeedsAllOfWhatItRestsOn) {
  see(2);
  EXPECT_EQ(concluded(), EstimatorState::kConverging) << "young";
  see(4);
  EXPECT_EQ(concluded(), EstimatorState::kConverged);
  EXPECT_EQ(concluded(false), EstimatorState::kConverging);
  const FrameOutcome good = outcome_;
  outcome_.near = false;
  EXPECT_EQ(concluded(), EstimatorState::kConverging);
  outcome_ = good;
  outcome_.contradicted = true;
  EXPECT_EQ(concluded(), EstimatorState::kConverging);
  outcome_ = good;
  outcome_.verdict = FrameVerdict::kDoubtful;
  EXPECT_EQ(concluded(), EstimatorState::kConverging);
  outcome_ = good;
  estimate_.hand_sd_m = 3e-3;
  EXPECT_EQ(concluded(), EstimatorState::kConverging);
  estimate_.hand_sd_m = 1e-3;
  known_.stalled.stepped(0, radians(3.0), radians(3.0), 4.0);
  EXPECT_EQ(concluded(), EstimatorState::kConverging) << "an encoder may stall";
}

TEST_F(ConvergenceOfOwnRobot, WhatDivergedOrIsOutOfViewStaysSo) {
  see(4);
  for (const auto state : {EstimatorState::kDiverged, EstimatorState::kHandNotInView}) {
    outcome_.state = state;
    EXPECT_EQ(concluded(), state);
  }
}

TEST_F(ConvergenceOfOwnRobot, AHiddenHandIsNotClaimed) {
  see(4);
  outcome_.hidden.hand = 0.9;
  EXPECT_EQ(concluded(), EstimatorState::kOccluded);
  outcome_.hidden.hand = 0.0;
  outcome_.hidden_only = true;
  outcome_.near = false;
  EXPECT_EQ(concluded(), EstimatorState::kOccluded);
}

TEST_F(ConvergenceOfOwnRobot, WhatNobodyBelievesIsAMisfitByName) {
  see(4, 3.0 * kLink_m);
  EXPECT_THAT(misfit(known_.memory, state_), IsEmpty());
  known_.forget();
  see(4, 6.0 * kLink_m);
  EXPECT_EQ(concluded(), EstimatorState::kModelMisfit);
  EXPECT_THAT(estimate_.misfit, HasSubstr("link_length of r_elbow"));
  EXPECT_THAT(estimate_.misfit, HasSubstr("6 times what is believed possible (estimator.state)"));
}

TEST_F(ConvergenceOfOwnRobot, TheLimitIsAsConfiguredOrByAPixelAndTolerances) {
  HandUncertainty hand{1e-6 * Eigen::Matrix3d::Identity(), 1e-6 * Eigen::Matrix3d::Identity(),
                       Eigen::MatrixXd::Zero(3, 2)};
  EstimatorOptions options;
  options.converged_hand_sd_m = 0.004;
  EXPECT_EQ(hand_sd_limit_m(options, state_, hand, 0.001), 0.004);
  options.converged_hand_sd_m = 0.0;
  EXPECT_NEAR(hand_sd_limit_m(options, state_, hand, 0.001), 0.001, 1e-12);
  EXPECT_NEAR(hand_sd_limit_m(options, state_, hand, 0.002), 0.002, 1e-12);
  hand.covariance_m2 = 4e-6 * Eigen::Matrix3d::Identity();
  EXPECT_NEAR(hand_sd_limit_m(options, state_, hand, 0.001), std::hypot(1e-3, 1.5 * 3e-3), 1e-12);
  hand.covariance_m2 = hand.own_m2;
  hand.J.col(1).setConstant(1e3);
  EXPECT_NEAR(hand_sd_limit_m(options, state_, hand, 0.001), 0.002, 1e-12) << "descriptions leave no more than this";
}

}  // namespace
}  // namespace bodyschema
