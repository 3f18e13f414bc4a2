#include "innovation_gate.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace bodyschema {
namespace {

/// Two joints' offsets, of which each frame measures both.
class GateOfTwoJoints : public ::testing::Test {
 protected:
  GateOfTwoJoints() : memory_({Eigen::Vector2d::Zero(), Eigen::Vector2d::Ones(), {true, true}, {}}, {}) {
    for (int posture = 0; posture < 8; ++posture) {
      const Eigen::VectorXd q = Eigen::Vector2d::Constant(0.3 * posture);
      memory_.add(posture, q, shows(0.0, 0.0), memory_.estimate().x);
    }
  }
  static Quadratic shows(double first_rad, double second_rad) {
    const Eigen::Vector2d x(first_rad, second_rad);
    return {Eigen::Matrix2d::Identity() / (kSd_rad * kSd_rad), x / (kSd_rad * kSd_rad)};
  }
  /// Of a frame near the arm.
  InnovationGate::Judgement judge(double first_rad, double second_rad = 0.0,
                                  const std::vector<Eigen::Index>& standing = {}) {
    return gate_.judge(memory_, shows(first_rad, second_rad), true, standing);
  }
  static constexpr double kSd_rad = 1e-3;
  PostureMemory memory_;
  InnovationGate gate_{2};
};

TEST_F(GateOfTwoJoints, AgreesDoubtsAndContradicts) {
  EXPECT_EQ(judge(0.0).verdict, FrameVerdict::kAgrees);
  const auto far = judge(0.1);
  EXPECT_EQ(far.verdict, FrameVerdict::kDoubtful);
  EXPECT_GT(far.innovation.nis, gate_.limit(far.innovation.dof));
  EXPECT_EQ(gate_.judge(memory_, shows(0.0, 0.0), false, {}).verdict, FrameVerdict::kContradicts)
      << "whatever its slopes say, its outline is not where the arm is";
}

TEST_F(GateOfTwoJoints, WhatAgreesBecomesUsualAndWhatIsDoubtedDoesNot) {
  const double off_rad = 3.8 * std::sqrt(2.0) * kSd_rad;
  ASSERT_EQ(judge(off_rad).verdict, FrameVerdict::kAgrees);
  for (int frame = 0; frame < 200; ++frame) judge(off_rad);
  const double usual = gate_.usual();
  EXPECT_GT(usual, 2.0);
  for (int frame = 0; frame < 200; ++frame) EXPECT_EQ(judge(0.2).verdict, FrameVerdict::kDoubtful);
  EXPECT_EQ(gate_.usual(), usual);
  gate_.forget_usual();
  EXPECT_EQ(gate_.usual(), 1.0);
}

// What moves slowly under a reading that stands makes its own deviations usual; it is held against what was so before.
TEST_F(GateOfTwoJoints, AJointUnderAStandingReadingIsHeldAgainstWhatWasUsualBefore) {
  const double off_rad = 3.8 * std::sqrt(2.0) * kSd_rad;
  for (int frame = 0; frame < 200; ++frame) judge(off_rad);
  const double step_rad = 4.5 * std::sqrt(2.0) * kSd_rad;
  EXPECT_EQ(judge(step_rad).verdict, FrameVerdict::kAgrees);
  EXPECT_EQ(judge(step_rad, 0.0, {0}).verdict, FrameVerdict::kDoubtful);
  gate_.reading_changed(0);
  EXPECT_EQ(judge(step_rad, 0.0, {0}).verdict, FrameVerdict::kAgrees);
}

}  // namespace
}  // namespace bodyschema
