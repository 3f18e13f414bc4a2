#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "bodyschema/estimator/estimator.hpp"
#include "occlusion.hpp"
#include "outline/own_robot.hpp"
#include "outline/synthetic_reach.hpp"

/// What hides the hand and what it holds, seen by the whole estimator: things are painted over exact silhouettes.
namespace bodyschema {
namespace {

using Paint = std::function<void(int frame, std::size_t camera, CameraObservation& seen)>;

class OcclusionOnOwnRobot : public OwnRobot {
 protected:
  OcclusionOnOwnRobot()
      : reach_(robot_, setup_, rig_, paper_offsets_rad()), projection_(robot_, setup_, rig_, reach_.roles()) {
    options_ = EstimatorOptions::from(configuration_);
    options_.silhouette.engine = "contour";
    Beliefs beliefs;
    for (const auto& target : effect_targets("joint_offset", reach_.roles())) {
      beliefs.state.push_back({"joint_offset", target, {options_.filter.initial_sd_rad}});
    }
    estimator_ = std::make_unique<Estimator>(robot_, setup_, rig_, beliefs, options_);
  }

  /// An arm that goes to and fro and turns its hand.
  [[nodiscard]] Eigen::VectorXd posture(int frame) const {
    Eigen::VectorXd q = pose(0.5 + 0.5 * std::sin(0.11 * frame));
    q(robot_->joint_index("r_wrist_prosup")) += 0.5 * std::sin(0.17 * frame);
    q(robot_->joint_index("r_wrist_pitch")) += 0.3 * std::sin(0.07 * frame);
    return q;
  }
  Estimate step(int frame, const Paint& paint = {}) {
    Observation seen = reach_.observe(posture(frame), frame * 100'000);
    for (std::size_t c = 0; paint && c < seen.cameras.size(); ++c) paint(frame, c, *seen.cameras[c]);
    return estimator_->step(seen);
  }
  Estimate follow(int from, int to, const Paint& paint = {}) {
    Estimate estimate;
    for (int frame = from; frame < to; ++frame) estimate = step(frame, paint);
    return estimate;
  }
  [[nodiscard]] double error_mm(const Estimate& estimate, int frame) {
    return 1e3 * (estimate.X_CP[0].translation() - reach_.true_hand(posture(frame), 0).translation()).norm();
  }

  static void set(CameraObservation& seen, int u, int v, bool robot) {
    seen.mask.set(u, v, robot);
    seen.coverage[static_cast<std::size_t>(v) * static_cast<std::size_t>(seen.mask.width()) +
                  static_cast<std::size_t>(u)] = robot ? 255 : 0;
  }
  /// A ball that the hand carries, taken for robot.
  [[nodiscard]] Paint ball(double radius_m) {
    return [this, radius_m](int frame, std::size_t camera, CameraObservation& seen) {
      const auto& k = rig_.cameras[camera].intrinsics;
      const Eigen::Vector3d p_C = reach_.true_hand(posture(frame), camera) * Eigen::Vector3d(0.0, -0.03, 0.10);
      paint_disc(seen, k.project(p_C), k.fx * radius_m / p_C.z(), true);
    };
  }
  /// Something before the hand that is taken for background, on the way from its base (0) to its fingertips (1).
  [[nodiscard]] Paint before_hand(double radius_px, double along) {
    return [this, radius_px, along](int frame, std::size_t camera, CameraObservation& seen) {
      projection_.place(posture(frame), reach_.roles().no_corrections(), camera);
      const Eigen::Vector3d base = projection_.hand().translation();
      Eigen::Vector3d tips = Eigen::Vector3d::Zero();
      for (const auto& X_CT : projection_.fingertips()) tips += X_CT.translation();
      tips /= static_cast<double>(projection_.fingertips().size());
      const auto& k = rig_.cameras[camera].intrinsics;
      paint_disc(seen, k.project(base + along * (tips - base)), radius_px, false);
    };
  }
  static void paint_disc(CameraObservation& seen, const Eigen::Vector2d& centre, double radius_px, bool robot) {
    for (int v = 0; v < seen.mask.height(); ++v) {
      for (int u = 0; u < seen.mask.width(); ++u) {
        if ((Eigen::Vector2d(u, v) - centre).squaredNorm() < radius_px * radius_px) set(seen, u, v, robot);
      }
    }
  }

  SyntheticReach reach_;
  RobotProjection projection_;
  EstimatorOptions options_;
  std::unique_ptr<Estimator> estimator_;
};

TEST_F(OcclusionOnOwnRobot, AnOpenHandBeforeAWallHidesNothing) {
  for (int frame = 0; frame < 40; ++frame) {
    const Estimate estimate = step(frame);
    if (frame < 20) continue;
    EXPECT_LT(estimate.hidden.hand, 0.05) << frame;
    EXPECT_FALSE(estimate.hidden.holds) << frame;
    EXPECT_EQ(estimate.hidden.text(), "") << frame;
  }
}

TEST_F(OcclusionOnOwnRobot, WhatHidesHalfTheHandIsLeftOutAndSaid) {
  follow(0, 40);
  for (int frame = 40; frame < 50; ++frame) {
    const Estimate estimate = step(frame, before_hand(30.0, 1.0));
    EXPECT_GT(estimate.hidden.hand, 0.15) << frame;
    EXPECT_NE(estimate.hidden.text().find("of the hand is hidden"), std::string::npos) << frame;
    EXPECT_NE(estimate.state, EstimatorState::kDiverged) << frame;
    EXPECT_EQ(estimate.changed, "") << frame;
    EXPECT_LT(error_mm(estimate, frame), 1.5) << frame;
  }
  const Estimate after = follow(50, 53);
  EXPECT_EQ(after.state, EstimatorState::kConverged);
  EXPECT_LT(error_mm(after, 52), 0.5);
}

TEST_F(OcclusionOnOwnRobot, AHiddenHandIsOccludedAndRightAgainAtOnce) {
  const Estimate before = follow(0, 40);
  ASSERT_EQ(before.state, EstimatorState::kConverged);
  for (int frame = 40; frame < 50; ++frame) {
    const Estimate estimate = step(frame, before_hand(90.0, 0.6));
    EXPECT_EQ(estimate.state, EstimatorState::kOccluded) << frame;
    EXPECT_TRUE(estimate.offset_rad.isApprox(before.offset_rad, 0.05)) << frame;
  }
  const Estimate after = follow(50, 52);
  EXPECT_EQ(after.state, EstimatorState::kConverged);
  EXPECT_LT(error_mm(after, 51), 0.5);
}

TEST_F(OcclusionOnOwnRobot, AThingInTheHandFromTheFirstPictureOnIsLearned) {
  const Paint thing = ball(0.035);
  int converged = 0;
  for (int frame = 0; frame < 90; ++frame) {
    const Estimate estimate = step(frame, thing);
    if (frame < 45) continue;
    converged += estimate.state == EstimatorState::kConverged;
    EXPECT_LT(error_mm(estimate, frame), 2.0) << frame;
    EXPECT_TRUE(estimate.hidden.holds || frame < 75) << frame;
  }
  EXPECT_GT(converged, 30);
}

/// A network's masks show a tool with the robot, and nothing of the hand within it: no mask says that it is elsewhere.
TEST_F(OcclusionOnOwnRobot, AHandWithinAToolThatGivenMasksShowIsNotMissed) {
  const auto with_tool = [&](bool given) {
    return Paint([this, given, tool = ball(0.06)](int frame, std::size_t camera, CameraObservation& seen) {
      tool(frame, camera, seen);
      seen.mask_is_given = given;
    });
  };
  const Paint of_others = with_tool(true), own = with_tool(false);
  for (int frame = 0; frame < 8; ++frame) {
    const Estimate estimate = step(frame, of_others);
    EXPECT_GT(estimate.hidden.hand, 0.4) << frame;
    EXPECT_LT(estimate.hidden.hand_missed, 0.2) << frame;
  }
  EXPECT_GT(step(8, own).hidden.hand_missed, 0.4);
}

/// The memory of an open hand is good: a thing that it takes up contradicts the pictures, not the memory.
TEST_F(OcclusionOnOwnRobot, AThingThatIsTakenUpCostsNoKnowledge) {
  follow(0, 40);
  const Paint thing = ball(0.035);
  for (int frame = 40; frame < 80; ++frame) {
    const Estimate estimate = step(frame, thing);
    EXPECT_NE(estimate.state, EstimatorState::kDiverged) << frame;
    EXPECT_EQ(estimate.changed, "") << frame;
    EXPECT_LT(error_mm(estimate, frame), 1.5) << frame;
  }
}

/// What a wrist that slips shows is a hand elsewhere, not a hidden one.
TEST_F(OcclusionOnOwnRobot, ASlipIsNotTakenForSomethingThatHides) {
  follow(0, 40);
  Eigen::VectorXd slipped = paper_offsets_rad();
  slipped(5) += radians(5.0);
  SyntheticReach other(robot_, setup_, rig_, slipped);
  Estimate estimate;
  for (int frame = 40; frame < 50; ++frame) estimate = estimator_->step(other.observe(posture(frame), frame * 100'000));
  EXPECT_NEAR(estimate.offset_rad(5), slipped(5), radians(0.5));
  EXPECT_LT(estimate.hidden.hand, 0.1);
}

/// A straight flank, 3 px a sample, of which [10, 20) was left out; points for what was found.
struct Flank {
  explicit Flank(bool edges_there) {
    for (int i = 0; i < 30; ++i) {
      OutlineSample sample{0, {100.0 + 3.0 * i, 100.0}, {0.0, -1.0}, 0.1};
      sample.odd = i >= 10 && i < 20;
      if (sample.odd && !edges_there && i % 5 != 0) sample.residual_px.reset();
      if (sample.odd && sample.residual_px) sample.residual_px = 3.0;
      samples.push_back(sample);
      if (!sample.residual_px) continue;
      OutlinePoint point;
      point.pixel = sample.pixel;
      point.odd = sample.odd;
      point.residual_px = *sample.residual_px;
      points.push_back(point);
    }
  }
  std::vector<OutlineSample> samples;
  std::vector<OutlinePoint> points;
};

TEST(WithoutHidden, WhatHasNoEdgeNearSaysNothingOfTheModel) {
  const Flank hidden(false);
  const auto shown = without_hidden(hidden.samples, hidden.points, 7.0, 1.0);
  EXPECT_EQ(hidden.points.size(), 22u);
  EXPECT_EQ(shown.size(), 20u);
  for (const auto& point : shown) EXPECT_FALSE(point.odd);
}

/// A hand of another make runs beside the model's for long pieces: that must not pass for something that hides.
TEST(WithoutHidden, AnEdgeThatRunsBesideThePredictionIsTheModelsError) {
  const Flank beside(true);
  EXPECT_EQ(without_hidden(beside.samples, beside.points, 7.0, 1.0).size(), 30u);
}

TEST(WithoutHidden, EdgesThatCrossThePredictionAreOtherThings) {
  Flank crossing(true);
  for (int i = 10; i < 20; ++i) {
    const auto k = static_cast<std::size_t>(i);
    crossing.samples[k].residual_px = crossing.points[k].residual_px = i - 14.5;
  }
  EXPECT_EQ(without_hidden(crossing.samples, crossing.points, 7.0, 1.0).size(), 20u);
}

}  // namespace
}  // namespace bodyschema
