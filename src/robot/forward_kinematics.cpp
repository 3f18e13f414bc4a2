#include "bodyschema/robot/forward_kinematics.hpp"

#include <cassert>
#include <limits>

#include "bodyschema/core/error.hpp"
#include "bodyschema/core/nearest_name.hpp"
#include "kinematic_tree.hpp"

namespace bodyschema {

struct ForwardKinematics::Impl {
  std::shared_ptr<const RobotModel> model;
  std::vector<TreeNode> nodes;           // the needed part of the tree, parents first, parent renumbered
  std::vector<double> value;             // of each node's joint at the last compute
  std::vector<KDL::Frame> X_PN, X_WN;    // pose of each node then, in its parent and in the world
  std::vector<bool> moved;               // whether the last compute changed X_WN
  std::vector<int> node_of_link;         // by position in the constructor's list
  std::vector<int> node_of_joint;        // by joint, -1 where not needed
  std::vector<std::vector<bool>> moves;  // [joint][link]
};

ForwardKinematics::ForwardKinematics(std::shared_ptr<const RobotModel> model, std::vector<std::string> links)
    : impl_(std::make_unique<Impl>()) {
  const KinematicTree& tree = model->impl().tree;
  const auto joint_count = static_cast<std::size_t>(model->joint_count());
  impl_->moves.assign(joint_count, std::vector<bool>(links.size(), false));

  std::vector<int> targets;
  std::vector<bool> needed(tree.nodes.size(), false);
  const auto need_with_ancestors = [&](int node) {
    for (; node >= 0 && !needed[static_cast<std::size_t>(node)];
         node = tree.nodes[static_cast<std::size_t>(node)].parent) {
      needed[static_cast<std::size_t>(node)] = true;
    }
  };
  for (std::size_t l = 0; l < links.size(); ++l) {
    const auto at = tree.node_of_link.find(links[l]);
    if (at == tree.node_of_link.end()) {
      throw ConfigurationError("robot '" + model->name() + "' has no link '" + links[l] + "'; did you mean '" +
                               nearest_name(links[l], model->link_names()) + "'?");
    }
    targets.push_back(at->second);
    need_with_ancestors(at->second);
    for (int n = at->second; n >= 0; n = tree.nodes[static_cast<std::size_t>(n)].parent) {
      const auto driver = tree.nodes[static_cast<std::size_t>(n)].driver;
      if (driver >= 0) impl_->moves[static_cast<std::size_t>(driver)][l] = true;
    }
  }
  // A driver that moves a link through its mimics may itself sit on another branch; its axis can
  // still be asked for.
  for (std::size_t j = 0; j < joint_count; ++j) {
    for (const bool moves : impl_->moves[j]) {
      if (moves) need_with_ancestors(tree.node_of_joint[j]);
    }
  }

  std::vector<int> renumber(tree.nodes.size(), -1);
  for (std::size_t n = 0; n < tree.nodes.size(); ++n) {
    if (!needed[n]) continue;
    renumber[n] = static_cast<int>(impl_->nodes.size());
    impl_->nodes.push_back(tree.nodes[n]);
    if (TreeNode& node = impl_->nodes.back(); node.parent >= 0) {
      node.parent = renumber[static_cast<std::size_t>(node.parent)];
    }
  }
  impl_->value.resize(impl_->nodes.size(), std::numeric_limits<double>::quiet_NaN());
  impl_->X_PN.resize(impl_->nodes.size());
  impl_->X_WN.resize(impl_->nodes.size());
  impl_->moved.resize(impl_->nodes.size());
  for (const int target : targets) {
    impl_->node_of_link.push_back(renumber[static_cast<std::size_t>(target)]);
  }
  for (const int node : tree.node_of_joint) {
    impl_->node_of_joint.push_back(renumber[static_cast<std::size_t>(node)]);
  }
  impl_->model = std::move(model);
}

ForwardKinematics::~ForwardKinematics() = default;
ForwardKinematics::ForwardKinematics(ForwardKinematics&&) noexcept = default;

void ForwardKinematics::compute(const Eigen::Ref<const Eigen::VectorXd>& q, std::span<Pose> X_WB) {
  assert(q.size() == impl_->model->joint_count());
  assert(X_WB.size() == impl_->node_of_link.size());
  // Particles of one picture differ in the arm alone: torso, head and fixed joints are where they were.
  for (std::size_t n = 0; n < impl_->nodes.size(); ++n) {
    const TreeNode& node = impl_->nodes[n];
    const auto parent = static_cast<std::size_t>(node.parent);
    const double value = node.joint_value(q);
    const bool turned = value != impl_->value[n];
    if (turned) {
      impl_->value[n] = value;
      impl_->X_PN[n] = node.segment.pose(value);
    }
    impl_->moved[n] = turned || (node.parent >= 0 && impl_->moved[parent]);
    if (impl_->moved[n]) impl_->X_WN[n] = node.parent < 0 ? impl_->X_PN[n] : impl_->X_WN[parent] * impl_->X_PN[n];
  }
  for (std::size_t l = 0; l < X_WB.size(); ++l) {
    const KDL::Frame& X = impl_->X_WN[static_cast<std::size_t>(impl_->node_of_link[l])];
    X_WB[l].linear() = to_eigen(X.M);
    X_WB[l].translation() = to_eigen(X.p);
    X_WB[l].makeAffine();
  }
}

ForwardKinematics::Axis ForwardKinematics::joint_axis(Eigen::Index joint) const {
  const int n = impl_->node_of_joint[static_cast<std::size_t>(joint)];
  if (n < 0) return {Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  const TreeNode& node = impl_->nodes[static_cast<std::size_t>(n)];
  const KDL::Frame X_WP = node.parent < 0 ? KDL::Frame::Identity() : impl_->X_WN[static_cast<std::size_t>(node.parent)];
  return {to_eigen(X_WP.M * node.segment.getJoint().JointAxis()),
          to_eigen(X_WP * node.segment.getJoint().JointOrigin())};
}

bool ForwardKinematics::moves(Eigen::Index joint, std::size_t link) const {
  return impl_->moves[static_cast<std::size_t>(joint)][link];
}

}  // namespace bodyschema
