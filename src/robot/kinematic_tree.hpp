#pragma once

#include <Eigen/Core>
#include <kdl/segment.hpp>
#include <map>
#include <string>
#include <vector>

#include "bodyschema/robot/robot_model.hpp"

namespace bodyschema {

/// One link with the joint that carries it. A joint's value is `multiplier * q[driver] + offset`;
/// for an ordinary joint that is q[driver] itself, for a fixed one `driver` is -1.
struct TreeNode {
  KDL::Segment segment;
  int parent = -1;           ///< position in KinematicTree::nodes; -1: the root link itself
  Eigen::Index driver = -1;  ///< position in the joint vector
  double multiplier = 1.0;
  double offset = 0.0;

  [[nodiscard]] double joint_value(const Eigen::Ref<const Eigen::VectorXd>& q) const {
    return driver < 0 ? 0.0 : multiplier * q[driver] + offset;
  }
};

/// The robot as KDL segments in breadth-first order: parents before children, root first.
///
/// KDL::Joint caches its last pose, so a segment must not be evaluated by two threads: users copy
/// the nodes they need.
struct KinematicTree {
  std::vector<TreeNode> nodes;
  std::map<std::string, int> node_of_link;
  /// For each entry of the joint vector, the node that the joint itself (not a mimic) moves.
  std::vector<int> node_of_joint;
};

struct RobotModel::Impl {
  std::string name;
  std::string root_link;
  std::vector<JointInfo> joints;
  std::map<std::string, Eigen::Index> joint_index;
  KinematicTree tree;
  std::vector<LinkMesh> meshes;
  std::vector<std::string> warnings;
  bool has_masses = false;
};

inline Eigen::Vector3d to_eigen(const KDL::Vector& v) {
  return {v.x(), v.y(), v.z()};
}
inline Eigen::Matrix3d to_eigen(const KDL::Rotation& R) {
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(R.data);
}

}  // namespace bodyschema
