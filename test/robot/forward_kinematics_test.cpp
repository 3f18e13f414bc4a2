#include "bodyschema/robot/forward_kinematics.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <random>

#include "bodyschema/camera/stereo_rig.hpp"
#include "bodyschema/core/error.hpp"
#include "robot/robot_test_data.hpp"
#include "temporary_folder.hpp"
#include "robot/urdf_walk.hpp"

namespace bodyschema {
namespace {

using nlohmann::json;

/// Largest difference between library and independent walk over all links and random joint values.
void expect_kinematics_match(const std::string& configuration, unsigned seed) {
  SCOPED_TRACE(configuration + ", seed " + std::to_string(seed));
  auto options = robot_setup(configuration).model;
  options.rendered_links.clear();
  const auto robot = RobotModel::load(options);
  const UrdfWalk walk(options.urdf);
  const auto links = robot->link_names();
  ASSERT_GT(links.size(), 40u);
  ForwardKinematics kinematics(robot, links);
  std::vector<Pose> X_WB(links.size());

  std::mt19937 random(seed);
  std::uniform_real_distribution<double> angle(-1.5, 1.5);
  for (int trial = 0; trial < 20; ++trial) {
    Eigen::VectorXd q(robot->joint_count());
    std::map<std::string, double> by_name;
    for (Eigen::Index j = 0; j < q.size(); ++j) {
      q[j] = angle(random);
      by_name[robot->joints()[static_cast<std::size_t>(j)].name] = q[j];
    }
    kinematics.compute(q, X_WB);
    for (std::size_t l = 0; l < links.size(); ++l) {
      const double difference = (X_WB[l].matrix() - walk.pose(links[l], by_name)).cwiseAbs().maxCoeff();
      ASSERT_LT(difference, 1e-9) << links[l];
    }
  }
}

TEST(ForwardKinematics, AgreesWithAProductOfTransformsOnTheOfficialRobot) {
  SKIP_WITHOUT("icub-models");
  expect_kinematics_match("icub_v2_5/robot.yaml", 1);
}

TEST(ForwardKinematics, AgreesWithAProductOfTransformsOnTheRecordingsRobot) {
  SKIP_WITHOUT("eyehand-sim");
  expect_kinematics_match("icub_unity/robot.yaml", 2);
}

TEST(ForwardKinematics, AgreesWithAProductOfTransformsOnOurRobot) {
  expect_kinematics_match("icub_right/robot.yaml", 6);
}

TEST(ForwardKinematics, PutsOurHandWhereANominalICubHasIt) {
  SKIP_WITHOUT("eyehand-sim");
  const auto pose_in_left_eye = [](const std::string& configuration) {
    RobotSetup setup = robot_setup(configuration);
    setup.model.rendered_links.clear();
    const auto robot = setup.load();
    ForwardKinematics kinematics(robot, {"l_eye_optical", "r_eye_optical", "r_hand"});
    std::vector<Pose> X_W(3);
    Eigen::VectorXd q = setup.default_joints(*robot);
    const std::map<std::string, double> posture_deg = {
        {"torso_pitch", 5}, {"torso_roll", -4},        {"torso_yaw", 8},        {"neck_pitch", -12},
        {"neck_roll", 6},   {"neck_yaw", -15},         {"eyes_tilt", -9},       {"l_eye_pan", 7},
        {"r_eye_pan", -6},  {"r_shoulder_pitch", -60}, {"r_shoulder_roll", 25}, {"r_shoulder_yaw", 14},
        {"r_elbow", 70},    {"r_wrist_prosup", 33},    {"r_wrist_pitch", -21},  {"r_wrist_yaw", 11}};
    for (const auto& [name, value] : posture_deg) q[robot->joint_index(name)] = radians(value);
    kinematics.compute(q, X_W);
    return std::pair<Pose, Pose>(X_W[0].inverse() * X_W[2], X_W[1].inverse() * X_W[2]);
  };
  const auto ours = pose_in_left_eye("icub_right/robot.yaml");
  const auto nominal = pose_in_left_eye("icub_unity/robot_v1.yaml");
  EXPECT_LT((ours.first.matrix() - nominal.first.matrix()).cwiseAbs().maxCoeff(), 2e-5);
  EXPECT_LT((ours.second.matrix() - nominal.second.matrix()).cwiseAbs().maxCoeff(), 2e-5);
}

TEST(ForwardKinematics, AgreesWithTheRecordingsTruthInAllPoses) {
  SKIP_WITHOUT("eyehand-sim");
  std::ifstream stream(data_folder() / "eyehand-sim/truth.json");
  const json truth = json::parse(stream);
  const Configuration configuration = robot_configuration("icub_unity/robot.yaml");
  RobotSetup setup = RobotSetup::from(configuration.section("robot"));
  const StereoRig rig = StereoRig::from(configuration.section("cameras"));
  setup.model.rendered_links.clear();
  const auto robot = setup.load();

  std::vector<std::string> links{rig.cameras[0].link, rig.cameras[1].link, setup.hand_link};
  for (const auto& finger : truth["fingers"]) links.push_back("r_" + finger.get<std::string>() + "_tip");
  ForwardKinematics kinematics(robot, links);
  std::vector<Pose> X_W(links.size());

  double worst_mm = 0.0, worst_deg = 0.0;
  ASSERT_EQ(truth["poses"].size(), 73u);
  for (const auto& pose : truth["poses"]) {
    Eigen::VectorXd q = setup.default_joints(*robot);
    const auto set = [&](const std::string& name, double value_deg) {
      q[robot->joint_index(name)] = radians(value_deg);
    };
    const auto& head = truth["head_encoders_deg"];
    for (const std::size_t i : {0u, 1u, 2u, 3u}) set(truth["head_joints"][i], head[i]);
    set("l_eye_pan", head[4].get<double>() + head[5].get<double>() / 2);
    set("r_eye_pan", head[4].get<double>() - head[5].get<double>() / 2);
    for (std::size_t i = 0; i < 16; ++i) {
      const std::string name = truth["encoder_joints"][i];
      if (name == "r_hand_finger") continue;  // moves nothing
      set(name, i < 7 ? pose["true_arm_deg"][i] : pose["encoders_deg"][i]);
    }
    kinematics.compute(q, X_W);
    for (const std::size_t c : {0u, 1u}) {
      const auto& matrix = pose[c == 0 ? "hand_in_left_camera" : "hand_in_right_camera"];
      Pose expected = Pose::Identity();
      for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 4; ++column) {
          expected(row, column) = matrix[static_cast<std::size_t>(row)][static_cast<std::size_t>(column)];
        }
      }
      const Pose X_CP = X_W[c].inverse() * X_W[2];
      worst_mm = std::max(worst_mm, 1e3 * (X_CP.translation() - expected.translation()).norm());
      worst_deg = std::max(worst_deg, degrees(rotation_distance(X_CP.linear(), expected.linear())));
    }
    for (std::size_t f = 0; f < 5; ++f) {
      const auto& tip = pose["fingertips_in_left_camera_m"][f];
      const Eigen::Vector3d expected_L(tip[0], tip[1], tip[2]);
      const Eigen::Vector3d tip_L = X_W[0].inverse() * X_W[3 + f].translation();
      worst_mm = std::max(worst_mm, 1e3 * (tip_L - expected_L).norm());
      // The right camera's pixels check tip and camera together; the file rounds them to 0.001 px.
      const Eigen::Vector3d tip_R = X_W[1].inverse() * X_W[3 + f].translation();
      const auto& pixel = pose["fingertips_px_right"][f];
      const Eigen::Vector2d expected_px(pixel[0], pixel[1]);
      EXPECT_LT((rig.cameras[1].intrinsics.project(tip_R) - expected_px).norm(), 0.1);
    }
  }
  RecordProperty("worst_mm", std::to_string(worst_mm));
  RecordProperty("worst_deg", std::to_string(worst_deg));
  EXPECT_LT(worst_mm, 0.1);
  EXPECT_LT(worst_deg, 0.01);
}

TEST(ForwardKinematics, MimicJointsFollowTheirDriverThroughChainsAndOffsets) {
  TemporaryFolder folder;
  const auto joint = [](const std::string& name, const std::string& parent, const std::string& child,
                        const std::string& mimic) {
    return R"(<joint name=")" + name + R"(" type="revolute"><parent link=")" + parent + R"("/><child link=")" + child +
           R"("/><axis xyz="0 0 1"/><limit lower="-9" upper="9" effort="1" velocity="1"/>)" + mimic + "</joint>";
  };
  const auto urdf = folder.write(
      "chain.urdf",
      R"(<robot name="chain"><link name="base"/><link name="driver"/><link name="first"/><link name="second"/>)" +
          joint("d", "base", "driver", "") +
          joint("a", "base", "first", R"(<mimic joint="b" multiplier="-0.5" offset="0.3"/>)") +
          joint("b", "base", "second", R"(<mimic joint="d" multiplier="2" offset="0.1"/>)") + "</robot>");
  const auto robot = RobotModel::load({urdf, {}, {}});
  ASSERT_EQ(robot->joint_count(), 1);
  EXPECT_EQ(robot->joints()[0].name, "d");
  EXPECT_FALSE(robot->find_joint("a").has_value());
  ForwardKinematics kinematics(robot, {"first", "second"});
  std::vector<Pose> X_WB(2);
  kinematics.compute(Eigen::VectorXd::Constant(1, 0.4), X_WB);
  const auto yaw = [](const Pose& X) { return std::atan2(X(1, 0), X(0, 0)); };
  EXPECT_NEAR(yaw(X_WB[1]), 2 * 0.4 + 0.1, 1e-12);
  EXPECT_NEAR(yaw(X_WB[0]), -0.5 * (2 * 0.4 + 0.1) + 0.3, 1e-12);
  EXPECT_TRUE(kinematics.moves(0, 0));
  EXPECT_LT((kinematics.joint_axis(0).direction_W - Eigen::Vector3d::UnitZ()).norm(), 1e-12);
}

TEST(ForwardKinematics, AxesGiveTheMotionOfTheHand) {
  RobotSetup setup = robot_setup("icub_right/robot.yaml");
  const auto robot = setup.load();
  ForwardKinematics kinematics(robot, {"r_hand", "l_eye_optical"});
  std::vector<Pose> X(2), X_up(2);
  Eigen::VectorXd q = Eigen::VectorXd::Constant(robot->joint_count(), 0.3);
  for (Eigen::Index j = 0; j < robot->joint_count(); ++j) {
    const std::string& name = robot->joints()[static_cast<std::size_t>(j)].name;
    SCOPED_TRACE(name);
    Eigen::VectorXd up = q;
    constexpr double step = 1e-6;
    up[j] += step;
    kinematics.compute(up, X_up);
    kinematics.compute(q, X);
    const auto axis = kinematics.joint_axis(j);
    const Eigen::Vector3d p = X[0].translation();
    const Eigen::Vector3d velocity = (X_up[0].translation() - p) / step;
    if (kinematics.moves(j, 0)) {
      EXPECT_LT((axis.direction_W.cross(p - axis.point_W) - velocity).norm(), 1e-5);
      EXPECT_NEAR(axis.direction_W.norm(), 1.0, 1e-12);
    } else {
      EXPECT_EQ(velocity.norm(), 0.0);
    }
    EXPECT_EQ(kinematics.moves(j, 0), name.rfind("torso", 0) == 0 || name.rfind("r_shoulder", 0) == 0 ||
                                          name.rfind("r_wrist", 0) == 0 || name == "r_elbow");
    if (!kinematics.moves(j, 0) && !kinematics.moves(j, 1)) {
      EXPECT_EQ(axis.direction_W.norm(), 0.0);
    }
  }
}

TEST(ForwardKinematics, WhatStaysWhereItWasIsWhatItWouldBeAnew) {
  const RobotSetup setup = robot_setup("icub_right/robot.yaml");
  const auto robot = setup.load();
  const auto& links = setup.model.rendered_links;
  ForwardKinematics kinematics(robot, links);
  std::vector<Pose> X_WB(links.size()), anew(links.size());
  std::mt19937 random(7);
  std::uniform_real_distribution<double> angle(-1.0, 1.0);
  Eigen::VectorXd q = Eigen::VectorXd::NullaryExpr(robot->joint_count(), [&] { return angle(random); });
  kinematics.compute(q, X_WB);
  for (Eigen::Index joint = 0; joint < q.size(); ++joint) {
    q[joint] = angle(random);
    if (joint % 3 == 0) q[0] = angle(random);  // the root, and all with it
    kinematics.compute(q, X_WB);
    ForwardKinematics(robot, links).compute(q, anew);
    for (std::size_t l = 0; l < links.size(); ++l) {
      ASSERT_EQ(X_WB[l].matrix(), anew[l].matrix()) << links[l] << " after joint " << joint;
    }
    const auto axis = kinematics.joint_axis(joint);
    ForwardKinematics again(robot, links);
    again.compute(q, anew);
    EXPECT_EQ(axis.point_W, again.joint_axis(joint).point_W);
  }
}

}  // namespace
}  // namespace bodyschema
