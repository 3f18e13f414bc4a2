#include <bodyschema/core/error.hpp>
#include <bodyschema/robot/forward_kinematics.hpp>
#include <bodyschema/robot/robot_model.hpp>
#include <cstdio>
#include <vector>

// Loads a robot and says where a link is: consumer <urdf> <link>
int main(int argc, char** argv) {
  if (argc != 3) {
    return 2;
  }
  try {
    const auto robot = bodyschema::RobotModel::load({.urdf = argv[1]});
    bodyschema::ForwardKinematics kinematics(robot, {argv[2]});
    std::vector<bodyschema::Pose> X_WB(1);
    kinematics.compute(Eigen::VectorXd::Zero(robot->joint_count()), X_WB);
    const Eigen::Vector3d p_WB = X_WB.front().translation();
    std::printf("%s: %s at (%.3f, %.3f, %.3f) m\n", robot->name().c_str(), argv[2], p_WB.x(), p_WB.y(), p_WB.z());
  } catch (const bodyschema::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
