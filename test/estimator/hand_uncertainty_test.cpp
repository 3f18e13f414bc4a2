#include "hand_uncertainty.hpp"

#include "outlines_of_own_robot.hpp"

namespace bodyschema {
namespace {

class HandOfOwnRobot : public OutlinesOfOwnRobot {
 protected:
  HandOfOwnRobot() : known_(model_->state(), layout(), {}, 3) { known_.in_frame = known_.memory.in_posture(); }
  /// Learns postures of a reach as a fit from the truth has them.
  void learn(int postures) {
    for (int i = 0; i < postures; ++i) {
      const Frame frame = at(0.2 * i);
      const OutlineFit fit = fitter_.follow(frame, memory_, truth_);
      memory_.add(frame.time_s, posture(frame), fit.seen.quadratic, fit.x);
      fitter_.learn_shape(fit, memory_.told());
    }
  }

  FusedState known_;
};

TEST(HandUncertainty, IsTheRootOfTheSummedVariances) {
  HandUncertainty hand;
  hand.own_m2 = Eigen::Vector3d(1e-6, 4e-6, 4e-6).asDiagonal();
  hand.covariance_m2 = Eigen::Vector3d(5e-6, 10e-6, 10e-6).asDiagonal();
  EXPECT_NEAR(hand.sd_m(), 5e-3, 1e-12);
  EXPECT_NEAR(hand.tolerated_sd_m(), 4e-3, 1e-12);
}

TEST_F(HandOfOwnRobot, BeforeAnyPostureIsWhatThePriorsMoveItBy) {
  const Eigen::MatrixXd none = Eigen::MatrixXd::Zero(7, 7);
  const auto hand = hand_uncertainty(*model_, frame_.exposures[0], known_, none);
  ASSERT_EQ(hand.J.cols(), 7);
  EXPECT_GE(hand.sd_m(), (hand.J * options_.filter.initial_sd_rad).norm());
  EXPECT_NEAR(hand.tolerated_sd_m(), 0.0, 1e-9) << "nothing is considered";
  EXPECT_EQ(hand.described_sd_m(model_->state()), 0.0) << "nothing but offsets is estimated";
}

TEST_F(HandOfOwnRobot, WhatShapesAddIsAdded) {
  const Eigen::MatrixXd none = Eigen::MatrixXd::Zero(7, 7);
  const Eigen::MatrixXd shape = std::pow(radians(1.0), 2) * Eigen::MatrixXd::Identity(7, 7);
  const auto without = hand_uncertainty(*model_, frame_.exposures[0], known_, none);
  const auto with = hand_uncertainty(*model_, frame_.exposures[0], known_, shape);
  EXPECT_NEAR(with.own_m2.trace() - without.own_m2.trace(), (with.J * shape * with.J.transpose()).trace(), 1e-12);
}

TEST_F(HandOfOwnRobot, ShapesAddNothingBeforeAnyPostureAndNoMoreThanThePriorAfterwards) {
  EXPECT_EQ(shape_covariance(memory_, fitter_.shape_variance_share(memory_.told())),
            Eigen::MatrixXd(Eigen::MatrixXd::Zero(7, 7)));
  ErrorModel larger(model_->roles());
  larger.add("mesh_scale", EffectTarget{}).parameters()[0].value = 0.05;
  reach_.befall(larger);
  learn(4);
  const Eigen::VectorXd variance = shape_covariance(memory_, fitter_.shape_variance_share(memory_.told())).diagonal();
  const Eigen::VectorXd prior = layout().prior_sd.cwiseAbs2();
  for (Eigen::Index k = 0; k < 7; ++k) {
    EXPECT_GT(variance[k], 0.0) << k;
    EXPECT_LE(variance[k], prior[k] * (1.0 + 1e-9)) << k;
  }
  fitter_.forget_shape();
  EXPECT_EQ(shape_covariance(memory_, fitter_.shape_variance_share(memory_.told())),
            Eigen::MatrixXd(Eigen::MatrixXd::Zero(7, 7)));
}

}  // namespace
}  // namespace bodyschema
