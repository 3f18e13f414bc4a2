#include "bodyschema/robot/forward_kinematics.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>

#include "bodyschema/camera/stereo_rig.hpp"
#include "bodyschema/core/error.hpp"
#include "robot/robot_test_data.hpp"
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
      const double difference =
          (X_WB[l].matrix() - walk.pose(links[l], by_name)).cwiseAbs().maxCoeff();
      ASSERT_LT(difference, 1e-9) << links[l];
    }
  }
}

TEST(ForwardKinematics, AgreesWithAProductOfTransformsOnTheOfficialRobot) {
  SKIP_WITHOUT_DATA();
  expect_kinematics_match("icub_v2_5/robot.yaml", 1);
}

TEST(ForwardKinematics, AgreesWithAProductOfTransformsOnTheRecordingsRobot) {
  SKIP_WITHOUT_DATA();
  expect_kinematics_match("icub_unity/robot.yaml", 2);
}

TEST(ForwardKinematics, AgreesWithTheRecordingsTruthInAllPoses) {
  SKIP_WITHOUT_DATA();
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

}  // namespace
}  // namespace bodyschema
