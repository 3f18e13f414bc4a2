#include "camera_axes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "bodyschema/core/seeded_random.hpp"
#include "bodyschema/robot/forward_kinematics.hpp"

namespace bodyschema {

bool has_body_axes(const std::shared_ptr<const RobotModel>& robot, const RobotSetup& setup, const StereoRig& rig,
                   std::size_t camera) {
  constexpr int kPostures = 4000, kEnough = 20;
  constexpr int kFarMore = 5;
  const auto& view = rig.cameras[camera];
  ForwardKinematics kinematics(robot, {view.link, setup.hand_link});
  std::array<Pose, 2> X_W;
  Eigen::Matrix3d to_optical;  // of what a body has ahead, to its left and above
  to_optical << 0, -1, 0, 0, 0, -1, 1, 0, 0;
  std::vector<std::string> moving = setup.estimated_joints;
  moving.insert(moving.end(), setup.head_joints.begin(), setup.head_joints.end());
  SeededRandom random(1);
  Eigen::VectorXd q = setup.default_joints(*robot);
  int as_camera = 0, as_body = 0;
  for (int i = 0; i < kPostures; ++i) {
    for (const auto& name : moving) {
      const auto joint = robot->joint_index(name);
      const auto& limits = robot->joints()[static_cast<std::size_t>(joint)];
      q(joint) = random.uniform(std::max(limits.lower_rad, -kPi), std::min(limits.upper_rad, kPi));
    }
    kinematics.compute(q, X_W);
    const Eigen::Vector3d hand = X_W[0].inverse(Eigen::Isometry) * X_W[1].translation();
    const auto shows = [&](const Eigen::Vector3d& p_C) {
      if (p_C.z() <= 0.0) return false;
      const Eigen::Vector2d pixel = view.intrinsics.project(p_C);
      return pixel.x() >= 0.0 && pixel.y() >= 0.0 && pixel.x() < view.intrinsics.width &&
             pixel.y() < view.intrinsics.height;
    };
    as_camera += shows(hand);
    as_body += shows(to_optical * hand);
  }
  return as_body >= kEnough && as_body > kFarMore * as_camera;
}

}  // namespace bodyschema
