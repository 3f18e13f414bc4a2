// Writes a robot's hand and the poses of many particles for bench_silhouette: loads the links named on
// the command line from a URDF, looks for an arm posture that brings the hand before the eyes, and
// spreads particles around it.

#include <cstdio>
#include <cstdlib>
#include <exception>
#include <random>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "bodyschema/robot/forward_kinematics.hpp"
#include "bodyschema/robot/robot_model.hpp"
#include "scene_file.hpp"

namespace {

using namespace bodyschema;

constexpr double kDistance_m = 0.30;
constexpr double kSpread_rad = 3.0 * kPi / 180.0;
constexpr std::size_t kParticles = 1000;
constexpr std::uint32_t kSeed = 1;

int run(const std::vector<std::string>& arguments) {
  if (arguments.size() < 6) {
    std::fprintf(stderr,
                 "usage: dump_scene FILE URDF MESH_ROOT LEFT_EYE RIGHT_EYE HAND[,HAND] [LINK ...]\n"
                 "  every HAND, which is brought before the eyes, and every LINK are drawn; LINK/optical is the\n"
                 "  camera of a LINK whose x points forward\n");
    return 2;
  }
  RobotModelOptions options;
  options.urdf = arguments[1];
  options.mesh_search_roots = {arguments[2]};
  std::istringstream list(arguments[5]);
  for (std::string hand; std::getline(list, hand, ',');) options.rendered_links.push_back(hand);
  const std::size_t hands = options.rendered_links.size();
  options.rendered_links.insert(options.rendered_links.end(), arguments.begin() + 6, arguments.end());
  for (const auto& eye : std::set<std::string>{arguments[3], arguments[4]}) {
    if (!eye.ends_with("/optical")) continue;
    AddedFrame frame{eye, eye.substr(0, eye.find('/')), Pose::Identity()};
    frame.X_PF.linear() << 0, 0, 1, -1, 0, 0, 0, -1, 0;  // z forward, x right
    options.added_frames.push_back(frame);
  }
  const auto robot = RobotModel::load(options);
  std::vector<std::string> links{arguments[3], arguments[4]};
  links.insert(links.end(), options.rendered_links.begin(), options.rendered_links.end());
  ForwardKinematics kinematics(robot, links);

  // The joints between the root and the hand but not the eyes are the arm's.
  std::vector<Eigen::Index> arm;
  for (Eigen::Index j = 0; j < robot->joint_count(); ++j) {
    bool moves = false;
    for (std::size_t h = 0; h < hands; ++h) moves = moves || kinematics.moves(j, 2 + h);
    if (moves && !kinematics.moves(j, 0)) arm.push_back(j);
  }
  std::mt19937 random(kSeed);
  std::uniform_real_distribution<double> uniform;
  std::normal_distribution<double> normal;
  std::vector<Pose> X_WB(links.size());
  const auto cost = [&](const Eigen::VectorXd& q) {
    kinematics.compute(q, X_WB);
    double sum = 0.0;
    for (std::size_t h = 0; h < hands; ++h) {
      const Eigen::Vector3d p_LH = (X_WB[0].inverse() * X_WB[2 + h]).translation();
      const Eigen::Vector3d p_RH = (X_WB[1].inverse() * X_WB[2 + h]).translation();
      const double beside_m = hands == 1 ? 0.0 : h == 0 ? 0.1 : -0.1;
      sum += (0.5 * (p_LH + p_RH) - Eigen::Vector3d(beside_m, 0.02, kDistance_m)).norm();
    }
    return sum;
  };
  Eigen::VectorXd q = Eigen::VectorXd::Zero(robot->joint_count());
  double best = 1e9;
  for (int attempt = 0; attempt < 20000; ++attempt) {
    Eigen::VectorXd candidate = q;
    for (const auto j : arm) {
      const auto& joint = robot->joints()[static_cast<std::size_t>(j)];
      const double range = joint.upper_rad - joint.lower_rad;
      candidate[j] = attempt < 5000
                         ? joint.lower_rad + uniform(random) * range
                         : std::clamp(q[j] + 0.02 * normal(random) * range, joint.lower_rad, joint.upper_rad);
    }
    const double c = cost(candidate);
    if (c < best) {
      best = c;
      q = candidate;
    }
  }
  std::fprintf(stderr, "%zu arm joints, hand %.0f mm from where it should be\n", arm.size(), 1000.0 * best);

  Scene scene;
  std::size_t triangles = 0;
  for (const auto& part : robot->meshes()) {
    scene.model.parts.push_back(part.mesh);
    triangles += part.mesh.triangles.size();
    std::fprintf(stderr, "%-20s %6zu triangles%s\n", part.link.c_str(), part.mesh.triangles.size(),
                 part.closed ? "" : ", open");
  }
  const PinholeIntrinsics camera{320, 240, 257.34, 257.34, 159.5, 119.5};
  scene.cameras = {camera, camera};
  for (std::size_t i = 0; i < kParticles; ++i) {
    Eigen::VectorXd particle = q;
    for (const auto j : arm) particle[j] += kSpread_rad * normal(random);
    kinematics.compute(particle, X_WB);
    for (std::size_t c = 0; c < 2; ++c) {
      for (std::size_t part = 2; part < links.size(); ++part) {
        scene.X_CB.push_back((X_WB[c].inverse() * X_WB[part]).cast<float>());
      }
    }
  }
  write_scene(arguments[0], scene);
  std::fprintf(stderr, "%zu triangles, %zu particles -> %s\n", triangles, kParticles, arguments[0].c_str());
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run({argv + 1, argv + argc});
  } catch (const std::exception& error) {
    std::fprintf(stderr, "dump_scene: %s\n", error.what());
    return 1;
  }
}
