#include "held_thing.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <deque>

namespace bodyschema {
namespace {

constexpr PinholeIntrinsics kCamera{320, 240, 257.0, 257.0, 160.0, 120.0};

/// A ball's silhouette.
void draw(const Eigen::Vector3d& p_C, double radius_m, BinaryMask& mask) {
  const Eigen::Vector2d centre = kCamera.project(p_C);
  const double r = kCamera.fx * radius_m / p_C.z();
  for (int v = 0; v < mask.height(); ++v) {
    for (int u = 0; u < mask.width(); ++u) {
      if ((Eigen::Vector2d(u, v) - centre).squaredNorm() < r * r) mask.set(u, v);
    }
  }
}

/// A hand like a ball, seen from another side in each frame.
class HeldThingTest : public ::testing::Test {
 protected:
  static Pose hand(int frame) {
    Pose X_CP = Pose::Identity();
    X_CP.linear() = (Eigen::AngleAxisd(0.3 * frame, Eigen::Vector3d(0.3, 1.0, 0.2).normalized()) *
                     Eigen::AngleAxisd(0.2 * frame, Eigen::Vector3d::UnitZ()))
                        .toRotationMatrix();
    X_CP.translation() = Eigen::Vector3d(0.02 * std::sin(frame), 0.015 * std::cos(2.0 * frame), 0.35);
    return X_CP;
  }
  /// @param thing_P  where in the hand's frame the mask shows something else; in that of the camera if it does not move
  ///   with it
  void show(int frame, const std::vector<Eigen::Vector3d>& things_P,
            const std::vector<Eigen::Vector3d>& things_C = {}) {
    BinaryMask mask(320, 240), robot(320, 240);
    const Pose X_CP = hand(frame);
    draw(X_CP.translation(), 0.03, mask);
    draw(X_CP.translation(), 0.035, robot);
    for (const auto& p : things_P) draw(X_CP * p, 0.025, mask);
    for (const auto& p : things_C) draw(p, 0.025, mask);
    const BinaryMask valid;
    if (!held.is_new(X_CP)) return;
    held.learn(std::vector<HeldThing::View>{{&kCamera, X_CP, &mask, &valid, &robot}});
  }
  [[nodiscard]] BinaryMask marked(int frame) { return held.mark(kCamera, hand(frame), 1.0); }
  HeldThing held;
};

TEST_F(HeldThingTest, WhatMovesWithTheHandIsHeld) {
  const Eigen::Vector3d thing_P(0.0, 0.0, 0.08);
  for (int frame = 0; frame < 12; ++frame) show(frame, {thing_P});
  ASSERT_TRUE(held.known());
  // In a view that was not learned from: the thing is covered, and little else.
  const BinaryMask cover = marked(14);
  BinaryMask thing(320, 240), beyond(320, 240);
  draw(hand(14) * thing_P, 0.025, thing);
  draw(hand(14) * thing_P, 0.05, beyond);
  std::size_t missed = 0, too_much = 0;
  BinaryMask robot(320, 240);
  draw(hand(14).translation(), 0.035, robot);
  for (int v = 0; v < 240; ++v) {
    for (int u = 0; u < 320; ++u) {
      missed += thing.at(u, v) && !cover.at(u, v) && !robot.at(u, v);
      too_much += cover.at(u, v) && !beyond.at(u, v);
    }
  }
  EXPECT_LT(missed, thing.count() / 10);
  EXPECT_LT(too_much, thing.count() / 4);
}

TEST_F(HeldThingTest, WhatStandsInTheRoomIsNot) {
  for (int frame = 0; frame < 12; ++frame) show(frame, {}, {{0.09, 0.0, 0.35}});
  EXPECT_FALSE(held.known());
}

TEST_F(HeldThingTest, AHandThatStandsTeachesNothing) {
  for (int i = 0; i < 50; ++i) show(0, {{0.0, 0.0, 0.08}});
  EXPECT_FALSE(held.known());
}

TEST_F(HeldThingTest, AThingThatWasPutDownIsForgotten) {
  for (int frame = 0; frame < 12; ++frame) show(frame, {{0.0, 0.0, 0.08}});
  ASSERT_TRUE(held.known());
  for (int frame = 12; frame < 30; ++frame) show(frame, {});
  EXPECT_FALSE(held.known());
}

TEST_F(HeldThingTest, AnEmptyHandHoldsNothing) {
  for (int frame = 0; frame < 20; ++frame) show(frame, {});
  EXPECT_FALSE(held.known());
  EXPECT_EQ(marked(3).count(), 0u);
}

}  // namespace
}  // namespace bodyschema
