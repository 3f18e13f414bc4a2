#include "left_as_it_is.hpp"

#include <gtest/gtest.h>

#include "bodyschema/geometry/pose.hpp"
#include "bodyschema/pipeline/pipeline.hpp"

namespace bodyschema {
namespace {

/// A state of the arm's seven offsets and a camera's pose, of which the first joint's offset and a turn are one.
class LeftAsItIs : public ::testing::Test {
 protected:
  LeftAsItIs() {
    estimate_.x = Eigen::VectorXd::Zero(state_.size());
    estimate_.covariance = radians(0.1) * radians(0.1) * Eigen::MatrixXd::Identity(state_.size(), state_.size());
    turn_ = state_.find("camera_pose", state_.model()[7].target(), 4);
    estimate_.covariance(0, 0) = estimate_.covariance(turn_, turn_) = radians(3.0) * radians(3.0);
    estimate_.covariance(0, turn_) = estimate_.covariance(turn_, 0) = -0.99 * radians(3.0) * radians(3.0);
  }

  static Configuration configuration() {
    return Configuration::load(std::filesystem::path(BODYSCHEMA_SOURCE_DIR) / "config/arm7/estimator.yaml",
                               {"vision.method=single_colour"});
  }
  static std::vector<Belief> beliefs(const JointRoles& roles) {
    std::vector<Belief> list;
    for (const auto& target : effect_targets("joint_offset", roles)) {
      list.push_back({"joint_offset", target, {radians(5.0)}});
    }
    list.push_back({"camera_pose", {}, {0.1, 0.1, 0.1, radians(8.0), radians(8.0), radians(8.0)}});
    return list;
  }

  Pipeline pipeline_{configuration()};
  JointRoles roles_ = JointRoles::of(pipeline_.shared_robot(), pipeline_.setup(), pipeline_.rig());
  State state_{roles_, beliefs(roles_)};
  MemoryEstimate estimate_;
  Eigen::Index turn_ = 0;
};

TEST_F(LeftAsItIs, WhatPicturesLeaveOpenStays) {
  estimate_.x[0] = radians(2.0);  // 0.7 standard deviations
  EXPECT_EQ(left_as_they_are(state_, estimate_, {0}), std::vector<std::size_t>{0});
}

TEST_F(LeftAsItIs, WhatPicturesContradictDoesNotAndTheOthersDo) {
  estimate_.x[0] = radians(2.0);
  estimate_.x[2] = radians(0.5);  // 5
  EXPECT_EQ(left_as_they_are(state_, estimate_, {0, 2}), std::vector<std::size_t>{0});
  EXPECT_TRUE(left_as_they_are(state_, estimate_, {2}).empty());
}

/// Each of two joints may stay, both together not.
TEST_F(LeftAsItIs, TogetherTheyAreJudgedAsTheyHoldTogether) {
  estimate_.covariance(1, 2) = estimate_.covariance(2, 1) = -0.9 * radians(0.1) * radians(0.1);
  estimate_.x[1] = radians(0.09);
  estimate_.x[2] = radians(0.08);
  EXPECT_EQ(left_as_they_are(state_, estimate_, {1}).size(), 1u);
  EXPECT_EQ(left_as_they_are(state_, estimate_, {2}).size(), 1u);
  EXPECT_EQ(left_as_they_are(state_, estimate_, {1, 2}), std::vector<std::size_t>{2});
}

TEST_F(LeftAsItIs, WhatHoldsTogetherWithItMovesAlong) {
  estimate_.x[0] = radians(4.0);
  estimate_.x[1] = radians(1.0);
  const Eigen::VectorXd x = given_as_believed(state_, estimate_, {0});
  EXPECT_EQ(x[0], 0.0);
  EXPECT_EQ(x[1], estimate_.x[1]);
  EXPECT_NEAR(degrees(x[turn_]), 0.99 * 4.0, 1e-9);
}

/// The turn went with the joint: of what both changed together nothing is left, of what is another joint's all.
TEST_F(LeftAsItIs, AChangeIsSeenBesideIt) {
  Eigen::VectorXd change = Eigen::VectorXd::Zero(state_.size());
  change[0] = radians(1.0);
  change[1] = radians(0.2);
  change[turn_] = -0.99 * radians(1.0);
  const Eigen::VectorXd left = beside(state_, estimate_, {0}, change);
  EXPECT_EQ(left[0], 0.0);
  EXPECT_NEAR(degrees(left[1]), 0.2, 1e-9);
  EXPECT_NEAR(degrees(left[turn_]), 0.0, 1e-9);
}

TEST_F(LeftAsItIs, BeliefsHoldThatAndNothingElse) {
  const auto held = held_as_believed(beliefs(roles_), state_, {0});
  ASSERT_EQ(held.size(), 8u);
  EXPECT_LT(held[0].sd[0], 0.01 * radians(5.0));
  EXPECT_GT(held[0].sd[0], 0.0);
  EXPECT_EQ(held[1].sd[0], radians(5.0));
  EXPECT_EQ(held[7].sd[0], 0.1);
}

}  // namespace
}  // namespace bodyschema
