#include "bodyschema/effects/corrected_kinematics.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "bodyschema/geometry/pose.hpp"

namespace bodyschema {
namespace {

std::shared_ptr<const RobotModel> load(const std::string& urdf) {
  const auto file = std::filesystem::temp_directory_path() /
                    ("bodyschema_corrected_kinematics_" + std::to_string(::getpid()) + ".urdf");
  std::ofstream(file) << urdf;
  RobotModelOptions options;
  options.urdf = file;
  auto model = RobotModel::load(options);
  std::filesystem::remove(file);
  return model;
}

/// A planar arm of two links with a camera at its base; the second joint's frame lies 0.3 m along x.
std::shared_ptr<const RobotModel> robot() {
  return load(R"(<robot name="two"><link name="root"/><link name="one"/><link name="two"/>
    <link name="eye"/><link name="tip"/>
    <joint name="a" type="revolute"><parent link="root"/><child link="one"/><axis xyz="0 0 1"/>
      <limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
    <joint name="b" type="revolute"><parent link="one"/><child link="two"/><axis xyz="0 1 0"/>
      <origin xyz="0.3 0 0"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
    <joint name="t" type="fixed"><parent link="two"/><child link="tip"/><origin xyz="0.2 0 0"/></joint>
    <joint name="e" type="fixed"><parent link="root"/><child link="eye"/><origin xyz="0 0 -1"/></joint>
    </robot>)");
}

class CorrectedKinematicsTest : public testing::Test {
 protected:
  std::shared_ptr<const RobotModel> model = robot();
  CorrectedKinematics kinematics{model, {"one", "tip"}, {"eye"}};
  Corrections corrections{2};
  Eigen::VectorXd q = Eigen::Vector2d(0.4, -0.3);
  std::vector<Pose> X = std::vector<Pose>(2);
  Eigen::Vector3d tip(const Corrections& c) {
    kinematics.compute(q, c, 0, X);
    return X[1].translation();
  }
};

TEST_F(CorrectedKinematicsTest, PlainWithoutCorrections) {
  const double c = std::cos(0.4), s = std::sin(0.4);
  const double reach = 0.3 + 0.2 * std::cos(-0.3);
  const Eigen::Vector3d expected(c * reach, s * reach, 1.0 - 0.2 * std::sin(-0.3));
  EXPECT_LT((tip(corrections) - expected).norm(), 1e-12);
}

TEST_F(CorrectedKinematicsTest, JointCorrectionIsAdded) {
  corrections.dq = Eigen::Vector2d(0.05, -0.02);
  const auto corrected = tip(corrections);
  q += corrections.dq;
  EXPECT_LT((corrected - tip(Corrections(2))).norm(), 1e-12);
}

TEST_F(CorrectedKinematicsTest, LengthMovesAlongTheJointsAxisAndOnlyWhatLiesBeyond) {
  const auto plain = tip(corrections);
  const auto first = X[0];
  corrections.adjustments[1].along_m = 0.01;
  const Eigen::Vector3d axis(-std::sin(0.4), std::cos(0.4), 0.0);
  EXPECT_LT((tip(corrections) - plain - 0.01 * axis).norm(), 1e-12);
  EXPECT_LT((X[0].matrix() - first.matrix()).norm(), 1e-12);
}

TEST_F(CorrectedKinematicsTest, TiltTurnsTheAxisAndKeepsTheZeroPose) {
  corrections.adjustments[0].tilt_1_rad = 0.02;
  corrections.adjustments[0].tilt_2_rad = -0.01;
  q.setZero();
  const auto plain = tip(Corrections(2));
  EXPECT_LT((tip(corrections) - plain).norm(), 1e-12);
  // Turning by q about the tilted axis, written out.
  const Eigen::Vector3d tilt = 0.02 * kinematics.tilt_axis(0, 0) - 0.01 * kinematics.tilt_axis(0, 1);
  EXPECT_NEAR(tilt.z(), 0.0, 1e-12);
  q << 0.7, 0.2;
  const auto axis = Eigen::AngleAxisd(tilt.norm(), tilt.normalized()) * Eigen::Vector3d::UnitZ();
  const double b = 0.2;
  const Eigen::Vector3d p_one(0.3 + 0.2 * std::cos(b), 0.0, -0.2 * std::sin(b));
  const Eigen::Vector3d expected = Eigen::AngleAxisd(0.7, axis) * p_one + Eigen::Vector3d(0.0, 0.0, 1.0);
  EXPECT_LT((tip(corrections) - expected).norm(), 1e-12);
}

TEST_F(CorrectedKinematicsTest, ShiftMovesTheAxisAcrossItselfAndTurnsWithTheLinkThatCarriesIt) {
  const auto plain = tip(corrections);
  corrections.adjustments[1].shift_1_m = 0.01;
  corrections.adjustments[1].shift_2_m = -0.02;
  const Eigen::Vector3d shift = 0.01 * kinematics.tilt_axis(1, 0) - 0.02 * kinematics.tilt_axis(1, 1);
  EXPECT_LT((tip(corrections) - plain - shift).norm(), 1e-12);
  // Joint a carries b: half a turn of it brings the shift to the other side.
  q[0] += kPi;
  const auto turned = tip(Corrections(2));
  const Eigen::Vector3d across(-shift.x(), -shift.y(), shift.z());
  EXPECT_LT((tip(corrections) - turned - across).norm(), 1e-12);
  EXPECT_NEAR(shift.norm(), std::hypot(0.01, 0.02), 1e-12);
}

/// A hand that is screwed on otherwise turns by itself: the link that carries it, and its joint, stay.
TEST_F(CorrectedKinematicsTest, AMountMovesWhatALinkCarriesAndNotTheLink) {
  CorrectedKinematics both(model, {"two", "tip"}, {"eye"});
  both.compute(q, corrections, 0, X);
  const auto before = X;
  corrections.adjustments[1].mount_turn_rad = Eigen::Vector3d(0.45, 0.0, 0.0);
  corrections.adjustments[1].mount_shift_m = Eigen::Vector3d(0.003, 0.0, 0.0);
  both.compute(q, corrections, 0, X);
  EXPECT_LT((X[0].matrix() - before[0].matrix()).norm(), 1e-12);
  Pose expected = before[0];
  expected = expected * Eigen::AngleAxisd(0.45, Eigen::Vector3d::UnitX());
  expected.translation() = before[0] * Eigen::Vector3d(0.203, 0.0, 0.0);
  EXPECT_LT((X[1].matrix() - expected.matrix()).norm(), 1e-12);
}

TEST_F(CorrectedKinematicsTest, AdjustmentsOfTwoJointsCompose) {
  // Lengthening joint a's link along z and b's along its own axis: both are seen at the tip.
  const auto plain = tip(corrections);
  corrections.adjustments[0].along_m = 0.02;
  corrections.adjustments[1].along_m = 0.01;
  const Eigen::Vector3d axis(-std::sin(0.4), std::cos(0.4), 0.0);
  EXPECT_LT((tip(corrections) - plain - 0.01 * axis - Eigen::Vector3d(0, 0, 0.02)).norm(), 1e-12);
}

TEST_F(CorrectedKinematicsTest, CameraShiftMovesTheWorldTheOtherWay) {
  const auto plain = tip(corrections);
  corrections.camera.shift_m.x() = 0.001;
  EXPECT_LT((tip(corrections) - plain + Eigen::Vector3d(0.001, 0, 0)).norm(), 1e-12);
}

TEST_F(CorrectedKinematicsTest, ATurnOfTheCameraTurnsTheWorldTheOtherWay) {
  const auto plain = tip(corrections);
  corrections.camera.turn_rad = {0.02, -0.01, 0.03};
  const Eigen::AngleAxisd turn(corrections.camera.turn_rad.norm(), corrections.camera.turn_rad.normalized());
  EXPECT_LT((tip(corrections) - turn.inverse() * plain).norm(), 1e-12);
}

/// Two cameras half a metre apart, the second turned by a quarter about their common z; a torso carries both.
class CorrectedRigTest : public testing::Test {
 protected:
  /// Where the second camera is in the first, and the first in the root.
  std::pair<Pose, Pose> rig(const Corrections& c) {
    std::vector<Pose> X(1);
    kinematics.compute(q, c, 0, X);
    const Pose X_WF = kinematics.X_WC();
    kinematics.compute(q, c, 1, X);
    return {X_WF.inverse() * kinematics.X_WC(), X_WF};
  }
  std::shared_ptr<const RobotModel> model = load(R"(<robot name="two"><link name="root"/><link name="torso"/>
    <link name="arm"/><link name="first"/><link name="second"/>
    <joint name="t" type="revolute"><parent link="root"/><child link="torso"/><axis xyz="0 0 1"/>
      <limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
    <joint name="a" type="revolute"><parent link="root"/><child link="arm"/><axis xyz="0 1 0"/>
      <limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
    <joint name="f" type="fixed"><parent link="torso"/><child link="first"/><origin xyz="0.1 0 0"/></joint>
    <joint name="s" type="fixed"><parent link="torso"/><child link="second"/>
      <origin xyz="0.1 0.5 0" rpy="0 0 1.57079632679"/></joint></robot>)");
  CorrectedKinematics kinematics{model, {"arm"}, {"first", "second"}};
  Eigen::VectorXd q = Eigen::Vector2d(0.3, -0.2);
  Corrections corrections{2};
};

TEST_F(CorrectedRigTest, TheRigMovesAsOneAboutItsFirstCamerasAxes) {
  const auto [pair_before, first_before] = rig(corrections);
  corrections.camera.rig_shift_m = {0.01, -0.02, 0.03};
  corrections.camera.rig_turn_rad = {0.0, 0.0, 0.1};
  const auto [pair, first] = rig(corrections);
  EXPECT_LT((pair.matrix() - pair_before.matrix()).norm(), 1e-12);
  const Pose moved = first_before.inverse() * first;
  EXPECT_LT((moved.translation() - corrections.camera.rig_shift_m).norm(), 1e-12);
  EXPECT_LT((moved.linear() - Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitZ()).toRotationMatrix()).norm(), 1e-12);
}

TEST_F(CorrectedRigTest, ACamerasOwnCorrectionIsAboutItsOwnAxesAndLeavesTheOtherAlone) {
  std::vector<Pose> X(1);
  kinematics.compute(q, corrections, 1, X);
  const Pose before = kinematics.X_WC();
  corrections.camera.shift_m = {0.01, 0.0, 0.0};
  corrections.camera.turn_rad = {0.0, 0.05, 0.0};
  kinematics.compute(q, corrections, 1, X);
  const Pose moved = before.inverse() * kinematics.X_WC();
  EXPECT_LT((moved.translation() - corrections.camera.shift_m).norm(), 1e-12);
  EXPECT_LT((moved.linear() - Eigen::AngleAxisd(0.05, Eigen::Vector3d::UnitY()).toRotationMatrix()).norm(), 1e-12);
}

TEST_F(CorrectedKinematicsTest, BaseShiftMovesEveryLinkAlikeInTheRootFrame) {
  // The camera's axes are the root's here.
  const auto plain = tip(corrections);
  const auto first = X[0];
  corrections.base_shift_m = {0.001, -0.002, 0.003};
  EXPECT_LT((tip(corrections) - plain - corrections.base_shift_m).norm(), 1e-12);
  EXPECT_LT((X[0].translation() - first.translation() - corrections.base_shift_m).norm(), 1e-12);
}

/// Two joints with a sensor fixed between them, as in the upper arm of the official iCub; the arm hangs down
/// its first joint's axis.
std::shared_ptr<const RobotModel> sensor_between(const std::string& axis) {
  return load(R"(<robot name="two"><link name="root"/><link name="one"/><link name="sensor"/>
    <link name="two"/><link name="eye"/>
    <joint name="a" type="revolute"><parent link="root"/><child link="one"/><axis xyz=")" +
              axis + R"("/>
      <limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
    <joint name="s" type="fixed"><parent link="one"/><child link="sensor"/><origin xyz="0 0 -0.1"/></joint>
    <joint name="b" type="revolute"><parent link="sensor"/><child link="two"/><axis xyz="0 1 0"/>
      <origin xyz="0 0 -0.2"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
    <joint name="e" type="fixed"><parent link="root"/><child link="eye"/></joint>
    </robot>)");
}

TEST(CorrectedKinematics, LongerIsAwayFromTheRootAlsoBehindASensor) {
  CorrectedKinematics kinematics(sensor_between("0 0 1"), {"two"}, {"eye"});
  Corrections longer(2);
  longer.adjustments[0].along_m = 0.01;
  Pose X;
  kinematics.compute(Eigen::Vector2d(0.4, 0.2), longer, 0, {&X, 1});
  EXPECT_NEAR(X.translation().z(), -0.31, 1e-12);
}

/// Turned frames leave 1e-16 in an axis. What tilt_1 means must not depend on which of them is smaller.
TEST(CorrectedKinematics, RoundingDoesNotDecideAboutWhatATiltTurns) {
  const auto first_tilt = [](const std::string& axis) {
    CorrectedKinematics kinematics(sensor_between(axis), {"two"}, {"eye"});
    Pose X;
    kinematics.compute(Eigen::Vector2d::Zero(), Corrections(2), 0, {&X, 1});
    return kinematics.tilt_axis(0, 0);
  };
  EXPECT_LT((first_tilt("1e-12 0 1") - first_tilt("0 1e-12 1")).norm(), 1e-9);
}

}  // namespace
}  // namespace bodyschema
