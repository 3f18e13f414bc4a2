#include "bodyschema/estimator/contour_alignment.hpp"

#include "estimator/own_robot.hpp"
#include "estimator/synthetic_reach.hpp"

namespace bodyschema {
namespace {

/// Outlines of our own robot, seen without encoder errors, against predictions with some.
class ContourAlignmentOnOwnRobot : public OwnRobot {
 protected:
  ContourAlignmentOnOwnRobot()
      : reach_(robot_, setup_, rig_, Eigen::VectorXd::Zero(7)), body_(robot_, setup_, rig_, offsets()),
        alignment_(body_, silhouettes(), rig_.intrinsics(), {}) {}

  std::vector<Parameter> offsets() {
    std::vector<Parameter> parameters;
    for (const auto& joint : setup_.estimated_joints) {
      parameters.push_back({joint, ParameterKind::kJointOffset, robot_->joint_index(joint), 0.1});
    }
    return parameters;
  }
  SilhouetteModel silhouettes() {
    for (const auto& part : robot_->meshes()) model_.parts.push_back(part.mesh);
    model_.culling = setup_.culling;
    return model_;
  }

  SilhouetteModel model_;
  SyntheticReach reach_;
  BodyPoseModel body_;
  ContourAlignment alignment_;
  ContourEvidence evidence_;
};

TEST_F(ContourAlignmentOnOwnRobot, AtTheTruthNothingPulls) {
  alignment_.linearise(reach_.observe(pose(0.5), 0), Eigen::VectorXd::Zero(7), 4.0, evidence_);
  EXPECT_GT(evidence_.sampled, 100u);
  EXPECT_GT(evidence_.matched_share(), 0.95);
  EXPECT_LT(evidence_.rms_px(), 0.2);
}

// One Gauss-Newton step takes most of a small error of any one joint away.
TEST_F(ContourAlignmentOnOwnRobot, OneStepTakesASmallErrorAway) {
  const Observation seen = reach_.observe(pose(0.5), 0);
  for (Eigen::Index joint = 0; joint < 7; ++joint) {
    Eigen::VectorXd x = Eigen::VectorXd::Zero(7);
    x(joint) = radians(0.5);
    alignment_.linearise(seen, x, 10.0, evidence_);
    // In the direction of that joint alone: one pose cannot tell all seven apart.
    const double step = evidence_.b(joint) / evidence_.A(joint, joint);
    EXPECT_NEAR(step, -x(joint), 0.2 * x(joint)) << setup_.estimated_joints[static_cast<std::size_t>(joint)];
  }
}

TEST_F(ContourAlignmentOnOwnRobot, WhatLiesBeyondTheSearchIsNotMatched) {
  const Observation seen = reach_.observe(pose(0.5), 0);
  Eigen::VectorXd x = Eigen::VectorXd::Zero(7);
  x(0) = radians(8.0);
  alignment_.linearise(seen, x, 3.0, evidence_);
  const double narrow = evidence_.matched_share();
  alignment_.linearise(seen, x, 60.0, evidence_);
  EXPECT_LT(narrow, 0.6);
  EXPECT_GT(evidence_.matched_share(), narrow + 0.2);
}

TEST_F(ContourAlignmentOnOwnRobot, ACameraThatSawNothingSaysNothing) {
  Observation seen = reach_.observe(pose(0.5), 0);
  alignment_.linearise(seen, Eigen::VectorXd::Zero(7), 4.0, evidence_);
  const std::size_t both = evidence_.sampled;
  seen.cameras[1].reset();
  alignment_.linearise(seen, Eigen::VectorXd::Zero(7), 4.0, evidence_);
  EXPECT_LT(evidence_.sampled, both);
  EXPECT_GT(evidence_.sampled, 0u);
}

}  // namespace
}  // namespace bodyschema
