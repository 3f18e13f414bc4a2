#include "bodyschema/outline/coordinates.hpp"

#include "bodyschema/effects/effect_kind.hpp"
#include "outline/own_robot.hpp"

namespace bodyschema {
namespace {

class CoordinatesOfOwnRobot : public OwnRobot {
 protected:
  JointRoles roles_ = JointRoles::of(robot_, setup_, rig_);
  Coordinates coordinates_{roles_};
};

/// What is written through one of them is read back through it and through no other.
TEST_F(CoordinatesOfOwnRobot, EachIsOneNumberOfItsOwn) {
  Eigen::VectorXd values(coordinates_.size());
  for (Eigen::Index i = 0; i < coordinates_.size(); ++i) {
    const auto& coordinate = coordinates_[static_cast<std::size_t>(i)];
    Corrections corrections = roles_.no_corrections();
    coordinate.in(corrections) = 0.25;
    EXPECT_EQ(coordinate.in(std::as_const(corrections)), 0.25);
    coordinates_.read(corrections, values);
    EXPECT_EQ(values[i], 0.25) << i;
    EXPECT_EQ(values.cwiseAbs().sum(), 0.25) << i;
    EXPECT_EQ(coordinates_.find(coordinate), i);
  }
}

/// Effects may move nothing that has no coordinate: it would be left out of every fit without a word.
TEST_F(CoordinatesOfOwnRobot, HoldEverythingThatTheCataloguesEffectsMove) {
  Instant at;
  const auto n = static_cast<Eigen::Index>(roles_.names.size());
  at.camera = 1;
  at.utime = 5'000'000;
  at.encoder = at.q = at.qdot = at.qddot = at.gravity_torque = at.payload_torque = Eigen::VectorXd::Constant(n, 0.3);
  Eigen::VectorXd values(coordinates_.size());
  for (const auto& name : effect_names()) {
    // Latency moves joints that nobody sees as well.
    if (effect_kind(name).make(effect_targets(name, roles_).front(), roles_)->follows_motion()) continue;
    for (const auto& target : effect_targets(name, roles_)) {
      const auto effect = make_effect(name, target, roles_);
      for (auto& p : effect->parameters()) p.value = p.fitted ? p.typical : 1.0;
      at.camera = target.source == "left" || name == "first_camera" ? 0 : 1;
      Corrections before = roles_.no_corrections(), after = before;
      effect->observe({0, Eigen::VectorXd::Zero(n), Eigen::VectorXd::Zero(n)});
      effect->observe({60'000'000, at.encoder, Eigen::VectorXd::Zero(n)});
      effect->apply(at, after);
      coordinates_.read(after, values);
      EXPECT_GT(values.cwiseAbs().maxCoeff(), 0.0) << effect->description();
      for (std::size_t i = 0; i < coordinates_.all().size(); ++i) {
        coordinates_[i].in(before) = values[static_cast<Eigen::Index>(i)];
      }
      EXPECT_EQ(before.dq, after.dq) << effect->description();
    }
  }
}

TEST_F(CoordinatesOfOwnRobot, WhatTheRobotHasNotIsNotFound) {
  EXPECT_EQ(coordinates_.find({Coordinate::Kind::kJoint, roles_.index("torso_yaw")}), -1);
  EXPECT_EQ(coordinates_.find({Coordinate::Kind::kScale, static_cast<Eigen::Index>(roles_.segments.size())}), -1);
  EXPECT_GE(coordinates_.find({Coordinate::Kind::kRigTurn, 2}), 0);
  EXPECT_EQ(coordinates_.find({Coordinate::Kind::kRigTurn, 3}), -1);
}

}  // namespace
}  // namespace bodyschema
