#include "bodyschema/evidence/state.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "bodyschema/core/error.hpp"
#include "bodyschema/geometry/pose.hpp"
#include "effects/roles.hpp"

namespace bodyschema {
namespace {

using test::roles;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

std::vector<Belief> read(const std::string& yaml, const JointRoles& of = roles()) {
  const auto configuration = Configuration::parse("estimator:\n  state:\n" + yaml);
  auto list = read_beliefs(configuration.section("estimator").section("state"), of);
  configuration.reject_unknown_keys();
  return list;
}

const Belief* find(const std::vector<Belief>& list, const std::string& effect, const EffectTarget& target = {}) {
  const auto at =
      std::find_if(list.begin(), list.end(), [&](const Belief& b) { return b.effect == effect && b.target == target; });
  return at == list.end() ? nullptr : &*at;
}

TEST(Beliefs, OfAnEffectWithoutTargetAreOfEveryTarget) {
  const auto list =
      read("    link_length: {sd_mm: 2}\n    head_offset: {sd_deg: 3}\n    mesh_scale: {sd_percent: 1}\n");
  EXPECT_EQ(list.size(), 2u + 4u + 1u) << "two links, four joints of the neck, the whole body";
  ASSERT_NE(find(list, "link_length", {"prosup", ""}), nullptr);
  EXPECT_NEAR(find(list, "link_length", {"prosup", ""})->sd.at(0), 0.002, 1e-15);
  EXPECT_NEAR(find(list, "head_offset", {"neck_yaw", ""})->sd.at(0), radians(3.0), 1e-15);
  EXPECT_NEAR(find(list, "mesh_scale")->sd.at(0), 0.01, 1e-15);
}

TEST(Beliefs, OfATargetAreOfThatOneAlone) {
  const auto list = read(
      "    link_length of prosup: {sd_mm: 2}\n    joint_coupling of elbow with s_yaw: {sd_percent: 3}\n"
      "    mesh_scale hand: {sd_percent: 1}\n    principal_point difference: {sd_px: 0.4}\n");
  EXPECT_EQ(list.size(), 4u);
  EXPECT_NE(find(list, "link_length", {"prosup", ""}), nullptr);
  EXPECT_NEAR(find(list, "joint_coupling", {"elbow", "s_yaw"})->sd.at(0), 0.03, 1e-15);
  EXPECT_NE(find(list, "mesh_scale", {"", "hand"}), nullptr);
  EXPECT_EQ(find(list, "principal_point", {"", "difference"})->sd, (std::vector<double>{0.4, 0.4})) << "x and y alike";
}

TEST(Beliefs, AreByTheUnitOfTheParameters) {
  const auto list = read("    camera_pose: {sd_mm: 5, sd_deg: 0.5}\n    distortion: {sd: 0.02}\n");
  const double m = 0.005, rad = radians(0.5);
  ASSERT_EQ(find(list, "camera_pose")->sd.size(), 6u);
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(find(list, "camera_pose")->sd[k], m, 1e-15);
    EXPECT_NEAR(find(list, "camera_pose")->sd[k + 3], rad, 1e-15);
  }
  EXPECT_EQ(find(list, "distortion")->sd, std::vector<double>{0.02});
  EXPECT_EQ(find(read("    camera_pose: {sd_mm: 5, sd_deg: 0}\n"), "camera_pose")->sd[3], 0.0)
      << "moved, but not turned";
}

TEST(Beliefs, ALaterEntryReplacesAnEarlierOneAndZeroLeavesOut) {
  const auto list = read(
      "    link_length: {sd_mm: 2}\n    link_length of prosup: {sd_mm: 0}\n"
      "    latency: {sd_ms: 0}\n    mesh_scale: {sd_percent: 1}\n");
  EXPECT_NE(find(list, "link_length", {"s_yaw", ""}), nullptr);
  EXPECT_EQ(find(list, "link_length", {"prosup", ""}), nullptr);
  EXPECT_EQ(find(list, "latency"), nullptr);
  const auto narrower = read("    link_length: {sd_mm: 2}\n    link_length of prosup: {sd_mm: 7}\n");
  EXPECT_EQ(narrower.size(), 2u);
  EXPECT_NEAR(find(narrower, "link_length", {"prosup", ""})->sd.at(0), 0.007, 1e-15);
}

TEST(Beliefs, OffsetsComeFirstWhereverTheyStand) {
  const auto list = read("    mesh_scale: {sd_percent: 1}\n    joint_offset: {sd_deg: 5}\n");
  ASSERT_EQ(list.size(), 8u);
  EXPECT_EQ(list.front().effect, "joint_offset");
  EXPECT_EQ(list.back().effect, "mesh_scale");
}

/// One file serves robots of all kinds.
TEST(Beliefs, WhatThisRobotHasNotIsLeftOutWhereNoTargetIsNamed) {
  auto bare = roles();
  bare.fingers.clear();
  bare.cameras = {"only"};
  const auto list = read(
      "    finger_posture: {sd_deg: 1.5}\n    camera_pair: {sd_mm: 1, sd_deg: 1}\n"
      "    principal_point difference: {sd_px: 0.4}\n    mesh_scale: {sd_percent: 1}\n",
      bare);
  ASSERT_EQ(list.size(), 1u);
  EXPECT_EQ(list[0].effect, "mesh_scale");
}

TEST(Beliefs, WhatCannotBeIsAnErrorThatNamesTheKeyAndTheNearest) {
  const auto fails = [](const std::string& yaml, const std::string& words) {
    EXPECT_THAT([&] { read("    " + yaml + "\n"); },
                ThrowsMessage<ConfigurationError>(AllOf(HasSubstr("estimator.state"), HasSubstr(words))))
        << yaml;
  };
  fails("mesh_scail: {sd_percent: 1}", "'mesh_scale'");
  fails("link_length of elbw: {sd_mm: 1}", "'elbow'");
  fails("link_length of elbow: {sd_mm: 1}", "expected s_yaw or prosup");
  fails("principal_point middle: {sd_px: 1}", "expected common, difference, left or right");
  fails("mesh_scale: {sd_mm: 1}", "sd_percent");
  fails("camera_pose: {sd_mm: 1}", "sd_deg");
  fails("mesh_scale: {sd_percent: -1}", "-1");
  fails("mesh_scale: {sd_percent: .nan}", "sd_percent");
  fails("mesh_scale: {sd_percent: much}", "much");
  fails("mesh_scale: {sd_percent: 1, sd_deg: 1}", "sd_deg");
}

TEST(State, HoldsOffsetsFirstThenWhatElseIsUncertain) {
  State state(roles(), read("    camera_pose: {sd_mm: 5, sd_deg: 0}\n    joint_offset: {sd_deg: 5}\n"
                            "    backlash of elbow: {sd_deg: 1}\n"));
  ASSERT_EQ(state.size(), 7 + 3 + 1);
  EXPECT_EQ(state.joints(), 7);
  EXPECT_EQ(state.parameters()[3].name, "elbow");
  EXPECT_EQ(state.parameters()[3].joint, 9);
  EXPECT_EQ(state.parameters()[7].name, "camera_pose x");
  EXPECT_EQ(state.parameters()[7].joint, -1);
  EXPECT_EQ(state.parameters()[7].unit, "mm");
  EXPECT_EQ(state.parameters()[7].si_per_unit, 1e-3);
  EXPECT_EQ(state.parameters()[10].name, "backlash of elbow");
  EXPECT_NEAR(state.prior_sd()[3], radians(5.0), 1e-15);
  EXPECT_NEAR(state.prior_sd()[7], 0.005, 1e-15);
  EXPECT_EQ(state.find("camera_pose", {}, 2), 9);
  EXPECT_EQ(state.find("camera_pose", {}, 3), -1) << "its turn is what the model says";
  EXPECT_EQ(state.find("backlash", {"elbow", ""}, 0), 10);
}

TEST(State, SetsTheModelAndKeepsEffectsBounds) {
  State state(roles(), read("    joint_offset: {sd_deg: 5}\n    backlash of elbow: {sd_deg: 1}\n"));
  Eigen::VectorXd x = Eigen::VectorXd::LinSpaced(8, 0.01, 0.08);
  state.set(x);
  EXPECT_EQ(state.x(), x);
  EXPECT_EQ(state.model().offsets()[9], x[3]);
  x[7] = -0.1;
  state.set(x);
  EXPECT_GT(state.x()[7], 0.0) << "no play is narrower than none";
  EXPECT_EQ(state.x().head(7), x.head(7));
}

TEST(State, TakesValuesFromAModelThatHoldsThem) {
  State state(roles(), read("    joint_offset of elbow: {sd_deg: 5}\n    backlash of elbow: {sd_deg: 1}\n"));
  state.set(Eigen::Vector2d(0.02, 0.003));
  ErrorModel other(roles());
  other.add("joint_offset", {"elbow", ""}).parameters()[0].value = 0.05;
  other.add("latency", {"", ""}).parameters()[0].value = 0.04;
  state.set(other);
  EXPECT_EQ(state.x(), Eigen::VectorXd(Eigen::Vector2d(0.05, 0.003))) << "what the model does not hold stays";
}

/// Beliefs are about what lies beyond what is known already.
TEST(State, BesideAKnownModelItsCentreIsWhatIsKnown) {
  ErrorModel known(roles());
  known.add("latency", {}).parameters()[0].value = 0.03;
  known.add("link_length", {"prosup", ""}).parameters()[0].value = 0.004;
  State state(known, read("    joint_offset: {sd_deg: 5}\n    link_length: {sd_mm: 1}\n"));
  const auto k = state.find("link_length", {"prosup", ""}, 0);
  ASSERT_GE(k, 0);
  EXPECT_EQ(state.prior_mean()[k], 0.004);
  EXPECT_EQ(state.find("latency", {}, 0), -1) << "known, so not estimated";
  state.set(Eigen::VectorXd::Zero(state.size()));
  EXPECT_EQ(state.prior_mean()[k], 0.004) << "wherever it goes";
  EXPECT_EQ(state.model().find("latency", {})->parameters()[0].value, 0.03);
}

/// What whoever found an extended model left open of it is considered with its correlations, but for what is estimated.
TEST(Considered, IsWhatIsToleratedAndWhatAKnownModelLeavesOpen) {
  ErrorModel known(roles());
  known.add("link_length", {"prosup", ""}).parameters()[0].value = 0.004;
  known.add("latency", {}).parameters()[0].value = 0.03;
  Eigen::MatrixXd covariance(4, 4);
  covariance << 4e-6, 3e-6, 0.0, 1e-8,  //
      3e-6, 9e-6, 0.0, 0.0,             //
      0.0, 0.0, 1e-4, 0.0,              //
      1e-8, 0.0, 0.0, 1e-6;
  known.set_uncertainty({{{"link_length", {"prosup", ""}, 0},
                          {"latency", {}, 0},
                          {"joint_offset", {"elbow", ""}, 0},
                          {"focal_length", {}, 0}},
                         covariance});
  const auto offsets = read("    joint_offset: {sd_deg: 5}\n");
  const auto all = Considered::beside(State(known, offsets), {{"latency", {}, {0.004}}, {"baseline", {}, {0.001}}});
  ASSERT_EQ(all.effects.size(), 4u) << "latency, baseline, link and focal length; offsets are found anew";
  EXPECT_EQ(all.effects[2].parameters()[0].value, 0.004) << "as it is known";
  const Eigen::MatrixXd C = all.root * all.root.transpose();
  EXPECT_NEAR(C(0, 0), 9e-6 + 16e-6, 1e-15) << "latency: what was left open, and what is tolerated besides";
  EXPECT_NEAR(C(1, 1), 1e-6, 1e-15);
  EXPECT_NEAR(C(2, 2), 4e-6, 1e-15);
  EXPECT_NEAR(C(2, 0), 3e-6, 1e-15);
  EXPECT_NEAR(C(3, 2), 1e-8, 1e-15) << "of the cameras, which the rig holds already";
  EXPECT_NEAR(C(1, 0), 0.0, 1e-15);

  const auto some =
      Considered::beside(State(known, read("    joint_offset: {sd_deg: 5}\n    link_length: {sd_mm: 1}\n")), {});
  EXPECT_EQ(some.effects.size(), 2u) << "one link is estimated";
  EXPECT_EQ(Considered::beside(State(roles(), offsets), {}).root.size(), 0);
}

}  // namespace
}  // namespace bodyschema
