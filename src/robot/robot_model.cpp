#include "bodyschema/robot/robot_model.hpp"

#include <cmath>
#include <limits>
#include <set>
#include <sstream>

#include "bodyschema/core/error.hpp"
#include "bodyschema/core/nearest_name.hpp"
#include "kinematic_tree.hpp"
#include "mesh_file.hpp"
#include "mesh_repair.hpp"
#include "mesh_resource.hpp"
#include "primitive_mesh.hpp"
#include "urdf_file.hpp"

namespace bodyschema {
namespace {

namespace fs = std::filesystem;

KDL::Vector to_kdl(const urdf::Vector3& v) {
  return {v.x, v.y, v.z};
}
KDL::Frame to_kdl(const urdf::Pose& X) {
  const auto& r = X.rotation;
  return {KDL::Rotation::Quaternion(r.x, r.y, r.z, r.w), to_kdl(X.position)};
}

KDL::Frame to_kdl(const Pose& X) {
  const Eigen::Matrix3d R = X.linear();
  return {KDL::Rotation(R(0, 0), R(0, 1), R(0, 2), R(1, 0), R(1, 1), R(1, 2), R(2, 0), R(2, 1), R(2, 2)),
          KDL::Vector(X.translation().x(), X.translation().y(), X.translation().z())};
}

Pose to_eigen(const urdf::Pose& X) {
  Pose pose = Pose::Identity();
  const auto& r = X.rotation;
  pose.linear() = Eigen::Quaterniond(r.w, r.x, r.y, r.z).normalized().toRotationMatrix();
  pose.translation() = Eigen::Vector3d(X.position.x, X.position.y, X.position.z);
  return pose;
}

bool is_movable(const urdf::Joint& joint) {
  return joint.type == urdf::Joint::REVOLUTE || joint.type == urdf::Joint::CONTINUOUS ||
         joint.type == urdf::Joint::PRISMATIC;
}

KDL::RigidBodyInertia inertia_of(const urdf::Link& link) {
  if (!link.inertial) return KDL::RigidBodyInertia::Zero();
  const auto& in = *link.inertial;
  // The URDF gives the tensor in a frame at the centre of mass; KDL wants it in the link frame.
  return to_kdl(in.origin) *
         KDL::RigidBodyInertia(in.mass, KDL::Vector::Zero(),
                               KDL::RotationalInertia(in.ixx, in.iyy, in.izz, in.ixy, in.ixz, in.iyz));
}

/// The joint with its axis in the parent link's frame, as KDL wants it, and the link it carries.
KDL::Segment segment_of(const urdf::Link& link) {
  const urdf::Joint& joint = *link.parent_joint;
  const KDL::Frame X_PJ = to_kdl(joint.parent_to_joint_origin_transform);
  KDL::Joint kdl_joint(joint.name, KDL::Joint::Fixed);
  if (is_movable(joint)) {
    kdl_joint = KDL::Joint(joint.name, X_PJ.p, X_PJ.M * to_kdl(joint.axis),
                           joint.type == urdf::Joint::PRISMATIC ? KDL::Joint::TransAxis : KDL::Joint::RotAxis);
  }
  return KDL::Segment(link.name, kdl_joint, X_PJ, inertia_of(link));
}

struct Mimic {
  std::string driver;
  double multiplier = 1.0;
  double offset = 0.0;
};

/// Follows a chain of mimic joints to the one that is driven:
/// q = m1 (m2 q_driver + o2) + o1.
Mimic resolve_mimic(const urdf::ModelInterface& model, const urdf::Joint& joint, const std::string& file) {
  Mimic result{joint.name, 1.0, 0.0};
  std::set<std::string> seen;
  for (const urdf::Joint* at = &joint; at->mimic;) {
    if (!seen.insert(at->name).second) {
      throw FileError(file + ": joint '" + joint.name + "': its mimic chain is a cycle");
    }
    const std::string& next = at->mimic->joint_name;
    const auto found = model.joints_.find(next);
    if (found == model.joints_.end()) {
      std::vector<std::string> names;
      for (const auto& [name, unused] : model.joints_) names.push_back(name);
      throw FileError(file + ": joint '" + at->name + "' mimics unknown joint '" + next + "'; did you mean '" +
                      nearest_name(next, names) + "'?");
    }
    if (!is_movable(*found->second)) {
      throw FileError(file + ": joint '" + at->name + "' mimics '" + next + "', which does not move");
    }
    result.offset += result.multiplier * at->mimic->offset;
    result.multiplier *= at->mimic->multiplier;
    result.driver = next;
    at = found->second.get();
  }
  return result;
}

void build_tree(const UrdfTree& urdf_tree, const std::string& file, RobotModel::Impl& impl) {
  KinematicTree& tree = impl.tree;
  std::set<std::string> drivers;
  for (const urdf::Link* link : urdf_tree.links) {
    if (link->inertial && link->inertial->mass > 0.0) impl.has_masses = true;
    const int index = static_cast<int>(tree.nodes.size());
    TreeNode node;
    if (link->parent_joint) {
      node.segment = segment_of(*link);
      node.parent = tree.node_of_link.at(link->getParent()->name);
    } else {
      node.segment = KDL::Segment(link->name, KDL::Joint(KDL::Joint::Fixed), KDL::Frame::Identity(), inertia_of(*link));
    }
    tree.node_of_link.emplace(link->name, index);
    tree.nodes.push_back(std::move(node));

    if (!link->parent_joint) continue;
    const urdf::Joint& joint = *link->parent_joint;
    if (joint.type == urdf::Joint::FLOATING || joint.type == urdf::Joint::PLANAR) {
      impl.warnings.push_back("joint '" + joint.name + "' is floating or planar and is taken as fixed");
    }
    if (!is_movable(joint) || joint.mimic) continue;
    JointInfo info;
    info.name = joint.name;
    const bool unlimited = joint.type == urdf::Joint::CONTINUOUS || !joint.limits;
    constexpr double kInf = std::numeric_limits<double>::infinity();
    info.lower_rad = unlimited ? -kInf : joint.limits->lower;
    info.upper_rad = unlimited ? kInf : joint.limits->upper;
    info.slides = joint.type == urdf::Joint::PRISMATIC;
    info.parent_link = joint.parent_link_name;
    info.child_link = joint.child_link_name;
    impl.joint_index.emplace(info.name, static_cast<Eigen::Index>(impl.joints.size()));
    impl.joints.push_back(std::move(info));
    tree.node_of_joint.push_back(index);
  }

  for (std::size_t i = 0; i < tree.nodes.size(); ++i) {
    const urdf::Link* link = urdf_tree.links[i];
    if (!link->parent_joint || !is_movable(*link->parent_joint)) continue;
    const Mimic mimic = resolve_mimic(*urdf_tree.model, *link->parent_joint, file);
    tree.nodes[i].driver = impl.joint_index.at(mimic.driver);
    tree.nodes[i].multiplier = mimic.multiplier;
    tree.nodes[i].offset = mimic.offset;
  }
}

void add_frame(const AddedFrame& frame, KinematicTree& tree) {
  const auto parent = tree.node_of_link.find(frame.parent);
  if (parent == tree.node_of_link.end()) {
    throw ConfigurationError("frame '" + frame.name + "' cannot be added: there is no link '" + frame.parent + "'");
  }
  if (!tree.node_of_link.emplace(frame.name, static_cast<int>(tree.nodes.size())).second) {
    throw ConfigurationError("frame '" + frame.name + "' cannot be added: there is a link of that name");
  }
  TreeNode node;
  node.segment = KDL::Segment(frame.name, KDL::Joint(KDL::Joint::Fixed), to_kdl(frame.X_PF));
  node.parent = parent->second;
  tree.nodes.push_back(std::move(node));
}

constexpr std::size_t kMaxRenderedTriangles = 4'000'000;  // of all rendered links together

constexpr double kMaxReach_m = 1e6;  // beyond, what is computed with vertices overflows

/// Scales and places a mesh in the link frame; a mirroring scale turns the winding back.
void place(TriangleMesh& mesh, const Eigen::Vector3d& scale, const Pose& X_LM, const std::string& where) {
  for (auto& p : mesh.vertices) {
    const Eigen::Vector3d placed = X_LM * scale.cwiseProduct(p.cast<double>());
    // A mesh that is itself so large is named, with its part, where silhouettes are made of it.
    const double allowed_m = std::max(kMaxReach_m, static_cast<double>(p.cwiseAbs().maxCoeff()));
    if (!(placed.cwiseAbs().maxCoeff() <= allowed_m) || !placed.allFinite()) {
      throw FileError(where + ": mesh '" + mesh.name + "' reaches further than 1e6 m from its link, expected metres; " +
                      "are scale and origin right?");
    }
    p = placed.cast<float>();
  }
  if (scale.prod() < 0) {
    for (auto& t : mesh.triangles) std::swap(t[1], t[2]);
  }
}

bool all_positive(std::initializer_list<double> values) {
  for (const double v : values) {
    if (!(v > 0.0) || !std::isfinite(v)) return false;
  }
  return true;
}

TriangleMesh visual_mesh(const urdf::Visual& visual, const std::string& where, const fs::path& urdf_directory,
                         const RobotModelOptions& options) {
  if (!visual.geometry) throw FileError(where + ": a visual has no geometry");
  TriangleMesh mesh;
  Eigen::Vector3d scale = Eigen::Vector3d::Ones();
  switch (visual.geometry->type) {
    case urdf::Geometry::MESH: {
      const auto& shape = static_cast<const urdf::Mesh&>(*visual.geometry);
      scale = {shape.scale.x, shape.scale.y, shape.scale.z};
      if (!scale.allFinite() || scale.cwiseAbs().minCoeff() < 1e-12) {
        throw FileError(where + ": mesh '" + shape.filename + "': scale must be finite and not zero");
      }
      mesh = read_mesh_file(resolve_mesh(shape.filename, where, urdf_directory, options.mesh_search_roots));
      break;
    }
    case urdf::Geometry::BOX: {
      const auto& shape = static_cast<const urdf::Box&>(*visual.geometry);
      if (!all_positive({shape.dim.x, shape.dim.y, shape.dim.z})) {
        throw FileError(where + ": box sizes must be positive");
      }
      mesh = box_mesh({shape.dim.x, shape.dim.y, shape.dim.z});
      mesh.name = "box";
      break;
    }
    case urdf::Geometry::CYLINDER: {
      const auto& shape = static_cast<const urdf::Cylinder&>(*visual.geometry);
      if (!all_positive({shape.radius, shape.length})) {
        throw FileError(where + ": cylinder radius and length must be positive");
      }
      mesh = cylinder_mesh(shape.radius, shape.length);
      mesh.name = "cylinder";
      break;
    }
    case urdf::Geometry::SPHERE: {
      const auto& shape = static_cast<const urdf::Sphere&>(*visual.geometry);
      if (!all_positive({shape.radius})) {
        throw FileError(where + ": sphere radius must be positive");
      }
      mesh = sphere_mesh(shape.radius);
      mesh.name = "sphere";
      break;
    }
  }
  place(mesh, scale, to_eigen(visual.origin), where);
  return mesh;
}

/// `budget`: triangles that all links to come may have together.
LinkMesh link_mesh(const urdf::Link& link, const fs::path& file, const RobotModelOptions& options, std::size_t& budget,
                   std::vector<std::string>& warnings) {
  const std::string where = file.string() + ": link '" + link.name + "'";
  if (link.visual_array.empty()) {
    throw FileError(where + " is to be rendered but has no visual");
  }
  LinkMesh result;
  result.link = link.name;
  result.mesh.name = link.name;
  for (const auto& visual : link.visual_array) {
    TriangleMesh part = visual_mesh(*visual, where, file.parent_path(), options);
    if (part.triangles.size() > budget) {
      throw FileError(where + ": the rendered links have more than " + std::to_string(kMaxRenderedTriangles) +
                      " triangles together");
    }
    budget -= part.triangles.size();
    weld(part);
    if (part.triangles.empty()) {
      throw FileError(where + ": mesh '" + part.name +
                      "' has no triangle larger than a micrometre; is its scale right?");
    }
    const MeshReport report = check_and_orient(part);
    result.closed = result.closed && report.closed();
    result.consistent_winding = result.consistent_winding && report.consistent_winding();
    if (const std::string text = report.text(); !text.empty()) {
      warnings.push_back("link '" + link.name + "', mesh '" + part.name + "': " + text);
    }
    const auto first = static_cast<std::uint32_t>(result.mesh.vertices.size());
    result.mesh.vertices.insert(result.mesh.vertices.end(), part.vertices.begin(), part.vertices.end());
    for (const auto& t : part.triangles) {
      result.mesh.triangles.push_back({first + t[0], first + t[1], first + t[2]});
    }
  }
  return result;
}

}  // namespace

RobotModel::RobotModel() : impl_(std::make_unique<Impl>()) {}
RobotModel::~RobotModel() = default;

std::shared_ptr<const RobotModel> RobotModel::load(const RobotModelOptions& options) {
  const UrdfTree urdf_tree = read_urdf(options.urdf);
  const fs::path file = fs::absolute(options.urdf);
  std::shared_ptr<RobotModel> robot(new RobotModel);
  Impl& impl = *robot->impl_;
  impl.name = urdf_tree.model->name_;
  impl.root_link = urdf_tree.model->root_link_->name;
  build_tree(urdf_tree, options.urdf.string(), impl);
  for (const AddedFrame& frame : options.added_frames) add_frame(frame, impl.tree);

  std::set<std::string> rendered;
  std::size_t budget = kMaxRenderedTriangles;
  for (const std::string& name : options.rendered_links) {
    const auto link = urdf_tree.model->getLink(name);
    if (!link) {
      throw FileError(options.urdf.string() + ": no link '" + name + "' to render; did you mean '" +
                      nearest_name(name, robot->link_names()) + "'?");
    }
    if (!rendered.insert(name).second) {
      throw FileError(options.urdf.string() + ": link '" + name + "' is to be rendered twice");
    }
    impl.meshes.push_back(link_mesh(*link, file, options, budget, impl.warnings));
  }
  return robot;
}

const std::string& RobotModel::name() const {
  return impl_->name;
}
std::span<const JointInfo> RobotModel::joints() const {
  return impl_->joints;
}
Eigen::Index RobotModel::joint_count() const {
  return static_cast<Eigen::Index>(impl_->joints.size());
}

std::optional<Eigen::Index> RobotModel::find_joint(const std::string& name) const {
  const auto at = impl_->joint_index.find(name);
  if (at == impl_->joint_index.end()) return std::nullopt;
  return at->second;
}

Eigen::Index RobotModel::joint_index(const std::string& name) const {
  if (const auto index = find_joint(name)) return *index;
  std::vector<std::string> names;
  for (const auto& joint : impl_->joints) names.push_back(joint.name);
  throw ConfigurationError("robot '" + impl_->name + "' has no joint '" + name + "' that can be set; did you mean '" +
                           nearest_name(name, names) + "'?");
}

bool RobotModel::has_link(const std::string& name) const {
  return impl_->tree.node_of_link.count(name) != 0;
}

std::vector<std::string> RobotModel::link_names() const {
  std::vector<std::string> names;
  for (const auto& node : impl_->tree.nodes) names.push_back(node.segment.getName());
  return names;
}

const std::string& RobotModel::root_link() const {
  return impl_->root_link;
}
std::span<const LinkMesh> RobotModel::meshes() const {
  return impl_->meshes;
}
std::span<const std::string> RobotModel::warnings() const {
  return impl_->warnings;
}
bool RobotModel::has_masses() const {
  return impl_->has_masses;
}

}  // namespace bodyschema
