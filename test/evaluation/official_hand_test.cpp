#include "../../src/evaluation/official_hand.hpp"

#include <gtest/gtest.h>

#include <fstream>

#include "bodyschema/core/error.hpp"
#include "bodyschema/robot/forward_kinematics.hpp"
#include "temporary_folder.hpp"

namespace bodyschema {
namespace {

namespace fs = std::filesystem;

constexpr const char* kArm = R"(<robot name="arm">
  <link name="root"/><link name="hand"/>
  <joint name="wrist" type="revolute"><parent link="root"/><child link="hand"/>
    <origin xyz="0.1 0 0.3" rpy="0 0 0.5"/><axis xyz="0 0 1"/>
    <limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
</robot>)";

constexpr const char* kOther = R"(<robot name="other">
  <link name="base"/><link name="hand"/><link name="frame"/><link name="finger"/><link name="leg"/>
  <joint name="elbow" type="fixed"><parent link="base"/><child link="hand"/></joint>
  <joint name="to_leg" type="fixed"><parent link="base"/><child link="leg"/></joint>
  <joint name="to_frame" type="fixed"><parent link="hand"/><child link="frame"/>
    <origin xyz="0.01 0.02 0.03" rpy="-1.5 0.2 3"/></joint>
  <joint name="knuckle" type="revolute"><parent link="hand"/><child link="finger"/>
    <origin xyz="0.05 0 0" rpy="0 0 0"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="2" effort="1" velocity="1"/></joint>
</robot>)";

class OfficialHand : public testing::Test {
 protected:
  void SetUp() override {
    std::ofstream(folder_ / "arm.urdf") << kArm;
    std::ofstream(folder_ / "other.urdf") << kOther;
    graft_ = {folder_ / "arm.urdf", folder_ / "other.urdf", "hand", "hand", "frame", 0.01, "new_"};
  }
  const TemporaryFolder temporary_;
  const fs::path folder_ = temporary_.path();
  HandGraft graft_;
};

TEST_F(OfficialHand, ItsFrameLiesFurtherOutAlongZAndItsFingersMove) {
  const fs::path out = folder_ / "both.urdf";
  write_grafted_urdf(graft_, out);
  RobotModelOptions options;
  options.urdf = out;
  const auto robot = RobotModel::load(options);
  ForwardKinematics kinematics(robot, {"hand", "new_frame", "new_hand", "new_finger"});
  Eigen::VectorXd q = Eigen::VectorXd::Zero(robot->joint_count());
  q(robot->joint_index("wrist")) = 0.7;
  std::vector<Pose> X(4);
  kinematics.compute(q, X);
  Pose expected = X[0];
  expected.translate(Eigen::Vector3d(0, 0, 0.01));
  EXPECT_LT((X[1].matrix() - expected.matrix()).cwiseAbs().maxCoeff(), 1e-9);
  const Pose finger = X[2].inverse(Eigen::Isometry) * X[3];
  EXPECT_LT((finger.translation() - Eigen::Vector3d(0.05, 0, 0)).norm(), 1e-9);
  EXPECT_GE(robot->joint_index("knuckle"), 0);
}

TEST_F(OfficialHand, AMissingFrameIsNamed) {
  graft_.hand_frame = "palm";
  try {
    write_grafted_urdf(graft_, folder_ / "never.urdf");
    FAIL() << "no error";
  } catch (const DataError& error) {
    EXPECT_NE(std::string(error.what()).find("'palm'"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace bodyschema
