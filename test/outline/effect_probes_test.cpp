#include "bodyschema/outline/effect_probes.hpp"

#include <cmath>
#include <map>

#include "bodyschema/observation/joint_motion.hpp"
#include "outline/own_robot.hpp"

namespace bodyschema {
namespace {

using Kind = Coordinate::Kind;

class ProbesOfOwnRobot : public OwnRobot {
 protected:
  ProbesOfOwnRobot() {
    const auto n = robot_->joint_count();
    at_.encoder = at_.q = pose(0.5);
    at_.qdot = at_.qddot = at_.gravity_torque = at_.payload_torque = Eigen::VectorXd::Zero(n);
    elbow_ = roles_.index("r_elbow");
  }
  /// Amounts of the only fitted parameter's direction by coordinate.
  std::vector<std::map<Eigen::Index, double>> directions(EffectProbes& probes) const {
    std::vector<Direction> list;
    probes.directions(at_, list);
    std::vector<std::map<Eigen::Index, double>> result;
    for (const auto& direction : list) {
      auto& amounts = result.emplace_back();
      for (const auto& step : direction) amounts[static_cast<Eigen::Index>(step.coordinate)] = step.amount;
    }
    return result;
  }
  [[nodiscard]] Eigen::Index coordinate(Kind kind, Eigen::Index index) const {
    return coordinates_.find({kind, index});
  }

  JointRoles roles_ = JointRoles::of(robot_, setup_, rig_);
  Coordinates coordinates_{roles_};
  Instant at_;
  Eigen::Index elbow_ = 0;
};

TEST_F(ProbesOfOwnRobot, ADirectionIsPerSiUnitAndOnlyWhatTheEffectMoves) {
  ErrorModel model(roles_);
  model.add("joint_offset", {"r_elbow", ""});
  model.add("encoder_gain", {"r_elbow", ""}).parameters()[0].value = 0.02;  // away from zero as well
  model.add("camera_pose", {});
  EffectProbes probes(model, fitted_parameters(model), coordinates_);
  ASSERT_EQ(probes.parameters().size(), 8u);
  const auto d = directions(probes);
  const auto at_elbow = coordinate(Kind::kJoint, elbow_);
  ASSERT_EQ(d[0].size(), 1u);
  EXPECT_NEAR(d[0].at(at_elbow), -1.0, 1e-12);
  EXPECT_NEAR(d[1].at(at_elbow), at_.q[elbow_], 1e-12);
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const auto k = static_cast<std::size_t>(axis);
    EXPECT_NEAR(d[2 + k].at(coordinate(Kind::kRigShift, axis)), 1.0, 1e-12);
    EXPECT_NEAR(d[5 + k].at(coordinate(Kind::kRigTurn, axis)), 1.0, 1e-12);
  }
}

TEST_F(ProbesOfOwnRobot, WhatActsOnOneCameraMovesNothingInTheOther) {
  ErrorModel model(roles_);
  model.add("baseline", {});
  EffectProbes probes(model, fitted_parameters(model), coordinates_);
  at_.camera = 0;
  EXPECT_TRUE(directions(probes)[0].empty());
  at_.camera = 1;
  EXPECT_EQ(directions(probes)[0].size(), 1u);
}

/// A millisecond more of skew moves the arm by its speed where the picture was taken, not where its stamp says.
TEST_F(ProbesOfOwnRobot, ATimeIsProbedWhereAllTimesTogetherPutThePicture) {
  ErrorModel model(roles_);
  model.add("latency", {}).parameters()[0].value = -0.073;
  model.add("camera_skew", {}).parameters()[0].value = 0.134;
  const auto angle = [](double t_s) { return 0.5 * std::sin(3.0 * t_s); };
  std::vector<JointSample> samples;
  for (int i = 0; i <= 300; ++i) {
    samples.push_back({.utime = microseconds(0.01 * i), .q = at_.q, .qdot = {}});
    samples.back().q[elbow_] = angle(0.01 * i);
  }
  at_.camera = 1;
  joint_path(samples, microseconds(1.3), at_.path);
  EffectProbes probes(model, fitted_parameters(model), coordinates_);
  const double speed = 1.5 * std::cos(3.0 * (1.3 + 0.207));
  for (int picture = 0; picture < 3; ++picture) {
    const auto d = directions(probes);
    EXPECT_NEAR(d[0].at(coordinate(Kind::kJoint, elbow_)), -speed, 0.03);
    EXPECT_NEAR(d[1].at(coordinate(Kind::kJoint, elbow_)), speed, 0.03);
  }
}

/// Backlash has no derivative at zero; how it would show is the difference to one of a typical size.
TEST_F(ProbesOfOwnRobot, AMemoryIsProbedBySecantsThatSawTheSameSamples) {
  ErrorModel model(roles_);
  model.add("backlash", {"r_elbow", ""});
  EffectProbes probes(model, fitted_parameters(model), coordinates_);
  EXPECT_TRUE(directions(probes)[0].empty()) << "nothing was seen";
  JointSample sample{0, at_.q, at_.qdot};
  for (int i = 0; i <= 100; ++i) {  // upwards to where it stands
    sample.utime = i * 10'000;
    sample.q[elbow_] = at_.q[elbow_] - radians(20.0) * (1.0 - i / 100.0);
    probes.observe(sample);
  }
  const auto d = directions(probes)[0];
  ASSERT_EQ(d.size(), 1u);
  EXPECT_NEAR(d.at(coordinate(Kind::kJoint, elbow_)), -0.5, 1e-9) << "it stays half a width behind";
  probes.forget();
  EXPECT_TRUE(directions(probes)[0].empty());
}

TEST_F(ProbesOfOwnRobot, FollowTakesValuesOverAndKeepsWhatWasObserved) {
  ErrorModel model(roles_);
  auto& backlash = model.add("backlash", {"r_elbow", ""});
  EffectProbes probes(model, fitted_parameters(model), coordinates_);
  JointSample sample{0, at_.q, at_.qdot};
  const auto move_up = [&] {
    for (int i = 0; i <= 100; ++i) {
      sample.utime += 10'000;
      sample.q[elbow_] = at_.q[elbow_] - radians(20.0) * (1.0 - i / 100.0);
      probes.observe(sample);
    }
  };
  move_up();
  backlash.parameters()[0].value = radians(1.0);
  probes.follow(model);
  EXPECT_FALSE(directions(probes)[0].empty()) << "what was observed stays";
  move_up();
  EXPECT_NEAR(directions(probes)[0].at(coordinate(Kind::kJoint, elbow_)), -0.5, 1e-3);
}

TEST_F(ProbesOfOwnRobot, NeighboursStayAboveTheLeastThatMakesSense) {
  ErrorModel model(roles_);
  auto& backlash = model.add("backlash", {"r_elbow", ""});
  const double least = backlash.parameters()[0].at_least;
  ASSERT_GT(least, 0.0);
  backlash.parameters()[0].value = least;
  EffectProbes probes(model, fitted_parameters(model), coordinates_);
  JointSample sample{0, at_.q, at_.qdot};
  for (int i = 0; i <= 100; ++i) {
    sample.utime = i * 10'000;
    sample.q[elbow_] = at_.q[elbow_] - radians(20.0) * (1.0 - i / 100.0);
    probes.observe(sample);
  }
  // A narrower neighbour than nothing would be no play at all, and the difference to it half as steep.
  EXPECT_NEAR(directions(probes)[0].at(coordinate(Kind::kJoint, elbow_)), -0.5, 1e-3);
}

TEST_F(ProbesOfOwnRobot, SettingsAreNotFitted) {
  ErrorModel model(roles_);
  model.add("slip", {"r_elbow", ""});
  model.add("axis_tilt", {"r_elbow", ""});
  EXPECT_EQ(fitted_parameters(model), (std::vector<ParameterRef>{{0, 0}, {1, 0}, {1, 1}}));
}

}  // namespace
}  // namespace bodyschema
