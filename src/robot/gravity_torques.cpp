#include "bodyschema/robot/gravity_torques.hpp"

#include <cassert>
#include <vector>

#include "kinematic_tree.hpp"

namespace bodyschema {

struct GravityTorques::Impl {
  std::shared_ptr<const RobotModel> model;
  std::vector<TreeNode> nodes;
  std::vector<KDL::Frame> X_WN;
  std::vector<double> mass_kg;             // of the subtree that hangs on each node
  std::vector<KDL::Vector> moment_W_kg_m;  // its mass times its centre of mass
  Eigen::VectorXd torque_Nm;
};

GravityTorques::GravityTorques(std::shared_ptr<const RobotModel> model) : impl_(std::make_unique<Impl>()) {
  impl_->nodes = model->impl().tree.nodes;
  impl_->X_WN.resize(impl_->nodes.size());
  impl_->mass_kg.resize(impl_->nodes.size());
  impl_->moment_W_kg_m.resize(impl_->nodes.size());
  impl_->torque_Nm.resize(model->joint_count());
  impl_->model = std::move(model);
}

GravityTorques::~GravityTorques() = default;
GravityTorques::GravityTorques(GravityTorques&&) noexcept = default;

const Eigen::VectorXd& GravityTorques::compute(const Eigen::Ref<const Eigen::VectorXd>& q,
                                               const Eigen::Vector3d& gravity_W) {
  Impl& s = *impl_;
  assert(q.size() == s.model->joint_count());
  const KDL::Vector g(gravity_W.x(), gravity_W.y(), gravity_W.z());

  for (std::size_t n = 0; n < s.nodes.size(); ++n) {
    const TreeNode& node = s.nodes[n];
    const KDL::Frame X_PN = node.segment.pose(node.joint_value(q));
    s.X_WN[n] = node.parent < 0 ? X_PN : s.X_WN[static_cast<std::size_t>(node.parent)] * X_PN;
    const KDL::RigidBodyInertia& I = node.segment.getInertia();
    s.mass_kg[n] = I.getMass();
    s.moment_W_kg_m[n] = I.getMass() * (s.X_WN[n] * I.getCOG());
  }

  s.torque_Nm.setZero();
  for (std::size_t n = s.nodes.size(); n-- > 1;) {  // children before parents; the root is fixed
    const TreeNode& node = s.nodes[n];
    const auto parent = static_cast<std::size_t>(node.parent);
    s.mass_kg[parent] += s.mass_kg[n];
    s.moment_W_kg_m[parent] += s.moment_W_kg_m[n];
    if (node.driver < 0) continue;
    const KDL::Joint& joint = node.segment.getJoint();
    const KDL::Vector axis_W = s.X_WN[parent].M * joint.JointAxis();
    double work_per_unit = 0.0;  // of gravity, per radian or metre of this joint
    if (joint.getType() == KDL::Joint::TransAxis) {
      work_per_unit = s.mass_kg[n] * KDL::dot(axis_W, g);
    } else {
      const KDL::Vector point_W = s.X_WN[parent] * joint.JointOrigin();
      const KDL::Vector lever = s.moment_W_kg_m[n] - s.mass_kg[n] * point_W;
      work_per_unit = KDL::dot(axis_W, lever * g);  // `*` of KDL vectors is the cross product
    }
    s.torque_Nm[node.driver] += node.multiplier * work_per_unit;
  }
  return s.torque_Nm;
}

}  // namespace bodyschema
