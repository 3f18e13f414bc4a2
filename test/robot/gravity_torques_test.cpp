#include "bodyschema/robot/gravity_torques.hpp"

#include <gtest/gtest.h>

#include <random>

#include "robot/robot_test_data.hpp"
#include "temporary_folder.hpp"
#include "robot/urdf_walk.hpp"

namespace bodyschema {
namespace {

/// Gravity's torque is minus the gradient of the potential energy, here by central differences of
/// an energy summed over an independent kinematics.
void expect_minus_gradient_of_energy(const std::filesystem::path& urdf, unsigned seed) {
  SCOPED_TRACE(urdf.string() + ", seed " + std::to_string(seed));
  const auto robot = RobotModel::load({urdf, {}, {}});
  const UrdfWalk walk(urdf);
  const Eigen::Vector3d gravity_W(1.2, -0.7, -9.4);  // a robot that leans
  const auto energy_J = [&](const Eigen::VectorXd& q) {
    std::map<std::string, double> by_name;
    for (Eigen::Index j = 0; j < q.size(); ++j) {
      by_name[robot->joints()[static_cast<std::size_t>(j)].name] = q[j];
    }
    double energy = 0.0;
    for (const auto& [link, mass] : walk.masses()) {
      energy -= mass.kg * gravity_W.dot(walk.centre_of_mass(link, by_name));
    }
    return energy;
  };
  GravityTorques gravity(robot);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> angle(-1.5, 1.5);
  double largest_Nm = 0.0;
  for (int trial = 0; trial < 3; ++trial) {
    const Eigen::VectorXd q = Eigen::VectorXd::NullaryExpr(robot->joint_count(), [&] { return angle(random); });
    const Eigen::VectorXd torque_Nm = gravity.compute(q, gravity_W);
    for (Eigen::Index j = 0; j < q.size(); ++j) {
      Eigen::VectorXd up = q, down = q;
      constexpr double step = 1e-5;
      up[j] += step;
      down[j] -= step;
      const double expected = -(energy_J(up) - energy_J(down)) / (2 * step);
      EXPECT_NEAR(torque_Nm[j], expected, 1e-6) << robot->joints()[static_cast<std::size_t>(j)].name;
      largest_Nm = std::max(largest_Nm, std::abs(expected));
    }
  }
  EXPECT_GT(largest_Nm, 0.5);  // or nothing was tested
}

TEST(GravityTorques, AreMinusTheGradientOfEnergyOnOurRobot) {
  expect_minus_gradient_of_energy(std::filesystem::path(BODYSCHEMA_SOURCE_DIR) / "meshes/icub_right/icub_right.urdf",
                                  3);
}

TEST(GravityTorques, AreMinusTheGradientOfEnergyOnTheOfficialRobot) {
  SKIP_WITHOUT("icub-models");
  expect_minus_gradient_of_energy(robot_setup("icub_v2_5/robot.yaml").model.urdf, 4);
}

TEST(GravityTorques, CountPrismaticAndMimicJoints) {
  TemporaryFolder folder;
  const std::string mass = R"(<inertial><origin xyz="0.3 0.1 -0.2" rpy="0 0 0"/><mass value="2"/>)"
                           R"(<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>)";
  const auto urdf = folder.write(
      "slide.urdf",
      R"(<robot name="slide"><link name="base"/><link name="cart">)" + mass + R"(</link><link name="arm">)" + mass +
          R"(</link><link name="tool">)" + mass +
          R"(</link><joint name="lift" type="prismatic"><parent link="base"/><child link="cart"/><origin xyz="0 0 1" rpy="0.3 0 0"/><axis xyz="0 0.6 0.8"/><limit lower="-9" upper="9" effort="1" velocity="1"/></joint>)"
          R"(<joint name="turn" type="continuous"><parent link="cart"/><child link="arm"/><origin xyz="0.1 0 0" rpy="0 0.4 0"/><axis xyz="0 1 0"/></joint>)"
          R"(<joint name="follow" type="revolute"><parent link="arm"/><child link="tool"/><origin xyz="0 0.5 0" rpy="0 0 0"/><axis xyz="1 0 1"/><limit lower="-9" upper="9" effort="1" velocity="1"/><mimic joint="turn" multiplier="-0.5" offset="0.2"/></joint></robot>)");
  expect_minus_gradient_of_energy(urdf, 5);
}

TEST(GravityTorques, PointDownhill) {
  TemporaryFolder folder;
  // A 1 kg pendulum of 1 m along x that turns about -y: larger angles lift it.
  const auto urdf = folder.write(
      "pendulum.urdf",
      R"(<robot name="pendulum"><link name="base"/><link name="bob"><inertial><origin xyz="1 0 0" rpy="0 0 0"/><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link><joint name="j" type="continuous"><parent link="base"/><child link="bob"/><axis xyz="0 -1 0"/></joint></robot>)");
  GravityTorques gravity(RobotModel::load({urdf, {}, {}}));
  EXPECT_NEAR(gravity.compute(Eigen::VectorXd::Zero(1), {0, 0, -9.81})[0], -9.81, 1e-12);
}

}  // namespace
}  // namespace bodyschema
