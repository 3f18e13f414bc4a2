#include "bodyschema/outline/robot_projection.hpp"

#include "bodyschema/core/error.hpp"
#include "bodyschema/effects/error_model.hpp"
#include "outline/own_robot.hpp"

namespace bodyschema {
namespace {

class ProjectionOfOwnRobot : public OwnRobot {
 protected:
  std::vector<Eigen::Isometry3f> parts(const Corrections& corrections, std::size_t camera) {
    std::vector<Eigen::Isometry3f> X_CB(projection_.part_count());
    projection_.place(pose(0.5), corrections, camera);
    projection_.parts(X_CB);
    return X_CB;
  }
  /// Where a part's origin appears.
  [[nodiscard]] Eigen::Vector2d pixel(const Eigen::Isometry3f& X, std::size_t camera) const {
    const PinholeIntrinsics& k = rig_.cameras[camera].intrinsics;
    const Eigen::Vector3f p = X.translation();
    return {k.fx * p.x() / p.z() + k.cx, k.fy * p.y() / p.z() + k.cy};
  }
  JointRoles roles_ = JointRoles::of(robot_, setup_, rig_);
  RobotProjection projection_{robot_, setup_, rig_, roles_};
  Corrections change_ = roles_.no_corrections();
  const Corrections nothing_ = change_;
};

// The paper's sign: encoder = true + offset.
TEST_F(ProjectionOfOwnRobot, AnOffsetIsTakenFromTheEncoder) {
  ErrorModel model(roles_);
  model.add("joint_offset", {"r_elbow", ""}).parameters()[0].value = 0.1;
  Instant at;
  at.encoder = pose(0.5);
  at.encoder(robot_->joint_index("r_elbow")) += 0.1;
  model.corrections(at, change_);
  projection_.place(at.encoder, change_, 0);
  const Pose corrected = projection_.hand();
  projection_.place(pose(0.5), nothing_, 0);
  EXPECT_TRUE(corrected.isApprox(projection_.hand(), 1e-12));
}

TEST_F(ProjectionOfOwnRobot, FocalScaleMovesPixelsAwayFromTheCentreAndNotTheHand) {
  const auto before = parts(nothing_, 0);
  const Pose hand = projection_.hand();
  change_.camera.focal_scale = 0.01;
  const auto after = parts(change_, 0);
  EXPECT_TRUE(projection_.hand().isApprox(hand));
  const PinholeIntrinsics& k = rig_.cameras[0].intrinsics;
  const Eigen::Vector2d centre(k.cx, k.cy);
  for (std::size_t i = 0; i < before.size(); ++i) {
    EXPECT_LT((pixel(after[i], 0) - centre - 1.01 * (pixel(before[i], 0) - centre)).norm(), 1e-2);
  }
}

TEST_F(ProjectionOfOwnRobot, ThePrincipalPointMovesAllPixelsAlike) {
  const auto before = parts(nothing_, 1);
  change_.camera.cx_px = 2.0;
  change_.camera.cy_px = -1.0;
  const auto after = parts(change_, 1);
  for (std::size_t i = 0; i < before.size(); ++i) {
    EXPECT_LT((pixel(after[i], 1) - pixel(before[i], 1) - Eigen::Vector2d(2.0, -1.0)).norm(), 1e-2);
  }
}

TEST_F(ProjectionOfOwnRobot, SizeScalesThePartsOfASegmentAboutTheirOwnOrigins) {
  const auto before = parts(nothing_, 0);
  const std::size_t hand = roles_.segments.size() - 1;
  change_.shapes[hand].scale = 0.02;
  const auto after = parts(change_, 0);
  for (std::size_t i = 0; i < before.size(); ++i) {
    EXPECT_TRUE(after[i].translation().isApprox(before[i].translation()));
    EXPECT_NEAR(after[i].linear().col(0).norm(), projection_.segment_of(i) == hand ? 1.02 : 1.0, 1e-5) << i;
  }
}

TEST_F(ProjectionOfOwnRobot, ALinkThatDoesNotExistIsAnError) {
  setup_.hand_link = "r_hnad";
  EXPECT_THROW(RobotProjection(robot_, setup_, rig_, roles_), ConfigurationError);
}

}  // namespace
}  // namespace bodyschema
