#include "bodyschema/robot/robot_setup.hpp"

#include <algorithm>

#include "bodyschema/core/error.hpp"
#include "bodyschema/core/nearest_name.hpp"
#include "bodyschema/geometry/pose.hpp"

namespace bodyschema {
namespace {

void require(bool known, const std::string& place, const std::string& name, const std::string& robot,
             const std::vector<std::string>& candidates) {
  if (known) return;
  throw ConfigurationError(place + ": '" + name + "' is not in robot '" + robot + "'; did you mean '" +
                           nearest_name(name, candidates) + "'?");
}

}  // namespace

RobotSetup RobotSetup::from(const Configuration& robot) {
  RobotSetup setup;
  setup.model.urdf = robot.path("urdf");
  if (robot.has("mesh_search_roots")) {
    setup.model.mesh_search_roots = robot.paths("mesh_search_roots");
  }
  setup.model.rendered_links = robot.texts("rendered_links");
  setup.culling =
      robot.choice_or("face_culling", "none", {"none", "back"}) == "back" ? FaceCulling::kBack : FaceCulling::kNone;
  setup.hand_link = robot.text("hand_link");
  setup.fingertip_links = robot.texts_or("fingertip_links", {});
  setup.estimated_joints = robot.texts("estimated_joints");
  setup.head_joints = robot.texts_or("head_joints", {});
  const Configuration fixed = robot.section("fixed_joints_deg");
  for (const std::string& joint : fixed.keys()) {
    setup.fixed_joints_rad[joint] = radians(fixed.number(joint, -3600.0, 3600.0));
    setup.places["fixed_joints_deg." + joint] = fixed.place(joint);
  }
  const Configuration fixed_m = robot.section("fixed_joints_m");
  for (const std::string& joint : fixed_m.keys()) {
    setup.fixed_joints_m[joint] = fixed_m.number(joint, -100.0, 100.0);
    setup.places["fixed_joints_m." + joint] = fixed_m.place(joint);
  }
  const std::vector<double> gravity = robot.numbers_or("gravity_m_s2", {0.0, 0.0, -9.81});
  if (gravity.size() != 3) robot.fail("gravity_m_s2", "three numbers [x, y, z]");
  setup.gravity_W = {gravity[0], gravity[1], gravity[2]};
  if (!robot.text_or("extended_model", "").empty()) setup.extended_model = robot.path("extended_model");

  if (setup.model.rendered_links.empty()) robot.fail("rendered_links", "at least one link");
  if (setup.estimated_joints.empty()) robot.fail("estimated_joints", "at least one joint");
  auto sorted = setup.estimated_joints;
  std::sort(sorted.begin(), sorted.end());
  if (std::adjacent_find(sorted.begin(), sorted.end()) != sorted.end()) {
    robot.fail("estimated_joints", "each joint once");
  }
  for (const char* key : {"hand_link", "fingertip_links", "estimated_joints", "head_joints"}) {
    setup.places[key] = robot.place(key);
  }
  return setup;
}

std::shared_ptr<const RobotModel> RobotSetup::load() const {
  auto robot = RobotModel::load(model);
  std::vector<std::string> joint_names;
  for (const auto& joint : robot->joints()) joint_names.push_back(joint.name);
  /// @param entry  of the mapping that `key` is; empty: it is none
  const auto place = [&](const std::string& key, const std::string& entry = "") {
    const auto found = places.find(entry.empty() ? key : key + "." + entry);
    return found != places.end() ? found->second : "robot." + key;
  };
  const auto need_link = [&](const std::string& at, const std::string& name) {
    require(robot->has_link(name), at, name, robot->name(), robot->link_names());
  };
  const auto need_joint = [&](const std::string& at, const std::string& name) {
    require(robot->find_joint(name).has_value(), at, name, robot->name(), joint_names);
  };
  need_link(place("hand_link"), hand_link);
  for (const auto& name : fingertip_links) need_link(place("fingertip_links"), name);
  const auto slides = [&](const std::string& name) {
    return robot->joints()[static_cast<std::size_t>(robot->joint_index(name))].slides;
  };
  const auto need_turning = [&](const std::string& at, const std::string& name) {
    need_joint(at, name);
    if (slides(name)) throw ConfigurationError(at + ": '" + name + "' slides; expected joints that turn");
  };
  for (const auto& name : estimated_joints) need_turning(place("estimated_joints"), name);
  for (const auto& name : head_joints) need_turning(place("head_joints"), name);
  const auto need_fixed = [&](const std::string& at, const std::string& name, bool sliding, const char* instead) {
    need_joint(at, name);
    if (slides(name) == sliding) return;
    throw ConfigurationError(at + ": '" + name + (sliding ? "' turns" : "' slides") + "; give it under robot." +
                             instead);
  };
  for (const auto& [name, value] : fixed_joints_rad) {
    need_fixed(place("fixed_joints_deg", name), name, false, "fixed_joints_m");
  }
  for (const auto& [name, value] : fixed_joints_m) {
    need_fixed(place("fixed_joints_m", name), name, true, "fixed_joints_deg");
  }
  return robot;
}

Eigen::VectorXd RobotSetup::default_joints(const RobotModel& robot) const {
  Eigen::VectorXd q(robot.joint_count());
  for (Eigen::Index j = 0; j < q.size(); ++j) {
    const JointInfo& joint = robot.joints()[static_cast<std::size_t>(j)];
    q[j] = std::clamp(0.0, joint.lower_rad, joint.upper_rad);
  }
  for (const auto* fixed : {&fixed_joints_rad, &fixed_joints_m}) {
    for (const auto& [name, value] : *fixed) q[robot.joint_index(name)] = value;
  }
  return q;
}

}  // namespace bodyschema
