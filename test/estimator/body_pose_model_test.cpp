#include "bodyschema/estimator/body_pose_model.hpp"

#include "bodyschema/core/error.hpp"
#include "estimator/own_robot.hpp"

namespace bodyschema {
namespace {

/// One parameter of one kind on our own robot.
class BodyPoseModelOnOwnRobot : public OwnRobot {
 protected:
  BodyPoseModel with(ParameterKind kind, const std::string& joint = "") {
    const Eigen::Index index = joint.empty() ? -1 : robot_->joint_index(joint);
    return {robot_, setup_, rig_, {{joint, kind, index, 1.0}}};
  }
  std::vector<Eigen::Isometry3f> parts(BodyPoseModel& body, double value, std::size_t camera) {
    std::vector<Eigen::Isometry3f> X_CB(body.part_count());
    body.compute(pose(0.5), Eigen::VectorXd::Constant(1, value), camera, X_CB);
    return X_CB;
  }
  /// Where a part's origin appears.
  [[nodiscard]] Eigen::Vector2d pixel(const Eigen::Isometry3f& X, std::size_t camera) const {
    const PinholeIntrinsics& k = rig_.cameras[camera].intrinsics;
    const Eigen::Vector3f p = X.translation();
    return {k.fx * p.x() / p.z() + k.cx, k.fy * p.y() / p.z() + k.cy};
  }
};

// The paper's sign: encoder = true + offset.
TEST_F(BodyPoseModelOnOwnRobot, AnOffsetIsTakenFromTheEncoder) {
  BodyPoseModel body = with(ParameterKind::kJointOffset, "r_elbow");
  Eigen::VectorXd encoders = pose(0.5);
  encoders(robot_->joint_index("r_elbow")) += 0.1;
  const Pose corrected = body.hand_pose(encoders, Eigen::VectorXd::Constant(1, 0.1), 0);
  const Pose truth = body.hand_pose(pose(0.5), Eigen::VectorXd::Zero(1), 0);
  EXPECT_TRUE(corrected.isApprox(truth, 1e-12));
}

TEST_F(BodyPoseModelOnOwnRobot, FocalScaleMovesPixelsAwayFromTheCentreAndNotTheHand) {
  BodyPoseModel body = with(ParameterKind::kFocalScale);
  const auto before = parts(body, 0.0, 0), after = parts(body, 0.01, 0);
  const PinholeIntrinsics& k = rig_.cameras[0].intrinsics;
  const Eigen::Vector2d centre(k.cx, k.cy);
  for (std::size_t i = 0; i < before.size(); ++i) {
    const Eigen::Vector2d expected = 1.01 * (pixel(before[i], 0) - centre);
    EXPECT_LT((pixel(after[i], 0) - centre - expected).norm(), 1e-2);
  }
  EXPECT_TRUE(body.hand_pose(pose(0.5), Eigen::VectorXd::Constant(1, 0.01), 0)
                  .isApprox(body.hand_pose(pose(0.5), Eigen::VectorXd::Zero(1), 0)));
}

TEST_F(BodyPoseModelOnOwnRobot, ThePrincipalDifferenceIsSharedByBothCameras) {
  BodyPoseModel body = with(ParameterKind::kPrincipalDifferenceX);
  for (std::size_t camera : {0u, 1u}) {
    const auto before = parts(body, 0.0, camera), after = parts(body, 2.0, camera);
    const double expected_px = camera == 0 ? -1.0 : 1.0;
    for (std::size_t i = 0; i < before.size(); ++i) {
      const Eigen::Vector2d moved = pixel(after[i], camera) - pixel(before[i], camera);
      EXPECT_NEAR(moved.x(), expected_px, 1e-2);
      EXPECT_NEAR(moved.y(), 0.0, 1e-3);
    }
  }
}

TEST_F(BodyPoseModelOnOwnRobot, VergenceTurnsTheRightCameraAlone) {
  BodyPoseModel body = with(ParameterKind::kVergence);
  const auto left_before = parts(body, 0.0, 0), left_after = parts(body, 0.02, 0);
  const auto right_before = parts(body, 0.0, 1), right_after = parts(body, 0.02, 1);
  const Eigen::AngleAxisf turned(0.02f, Eigen::Vector3f::UnitY());
  for (std::size_t i = 0; i < left_before.size(); ++i) {
    EXPECT_TRUE(left_before[i].isApprox(left_after[i]));
    EXPECT_TRUE(right_after[i].isApprox(turned * right_before[i], 1e-5f));
  }
}

TEST_F(BodyPoseModelOnOwnRobot, SizeScalesEveryPartAboutItsOwnOrigin) {
  BodyPoseModel body = with(ParameterKind::kMeshScale);
  const auto before = parts(body, 0.0, 0), after = parts(body, 0.02, 0);
  for (std::size_t i = 0; i < before.size(); ++i) {
    EXPECT_TRUE(after[i].translation().isApprox(before[i].translation()));
    EXPECT_NEAR(after[i].linear().col(0).norm(), 1.02, 1e-5);
  }
}

TEST_F(BodyPoseModelOnOwnRobot, ALinkThatDoesNotExistIsAnError) {
  setup_.hand_link = "r_hnad";
  EXPECT_THROW(BodyPoseModel(robot_, setup_, rig_, {}), ConfigurationError);
}

}  // namespace
}  // namespace bodyschema
