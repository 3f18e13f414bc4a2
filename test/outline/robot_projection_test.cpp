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

// A larger hand: its fingers begin further from the palm, which stays where it is, as does the wrist's own part.
TEST_F(ProjectionOfOwnRobot, AnotherSizeMovesTheInnerJointsAwayFromTheCore) {
  const std::size_t hand = roles_.segments.size() - 1;
  const auto& segment = roles_.segments[hand];
  const auto part = [&](const char* link) {
    const auto& links = setup_.model.rendered_links;
    return static_cast<std::size_t>(std::find(links.begin(), links.end(), link) - links.begin());
  };
  ASSERT_EQ(segment.core, part("r_hand"));
  EXPECT_EQ(segment.inner.size(), 16u) << "thumb and fingers";
  const auto before = parts(nothing_, 0);
  change_.shapes[hand].size = 0.03;
  const auto after = parts(change_, 0);
  for (const char* link : {"r_hand", "r_thumb_4", "r_little_3"}) {
    const std::size_t p = part(link);
    const Eigen::Vector3f way = before[p].translation() - before[segment.core].translation();
    EXPECT_TRUE(after[p].translation().isApprox(before[p].translation() + 0.03f * way)) << link;
    EXPECT_NEAR(after[p].linear().col(0).norm(), 1.03, 1e-5) << link;
  }
  for (const char* link : {"r_wrist_2", "r_forearm"})
    EXPECT_TRUE(after[part(link)].isApprox(before[part(link)])) << link;
}

TEST_F(ProjectionOfOwnRobot, ALinkThatDoesNotExistIsAnError) {
  setup_.hand_link = "r_hnad";
  EXPECT_THROW(RobotProjection(robot_, setup_, rig_, roles_), ConfigurationError);
}

}  // namespace
}  // namespace bodyschema
