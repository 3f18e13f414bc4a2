#include "bodyschema/imports/joint_mapping.hpp"

#include <spdlog/fmt/fmt.h>
#include <spdlog/fmt/ranges.h>

#include <algorithm>

#include "bodyschema/core/error.hpp"
#include "bodyschema/core/nearest_name.hpp"

namespace bodyschema {
namespace {

JointMapping::Rule read_rule(const Configuration& joints, const std::string& column) {
  JointMapping::Rule rule;
  if (!joints.is_mapping(column)) {
    const std::string joint = joints.text(column);
    if (joint != JointMapping::kUnused) rule.joint = joint;
    return rule;
  }
  const Configuration section = joints.section(column);
  rule.joint = section.text("joint");
  constexpr double kLargest = 1e6;
  if (section.has("scale")) rule.scale = section.number("scale", -kLargest, kLargest);
  if (rule.scale && *rule.scale == 0.0) section.fail("scale", "a number other than 0");
  rule.offset = section.number_or("offset", 0.0, -kLargest, kLargest);
  return rule;
}

std::map<std::string, std::string> names(const Configuration& section) {
  std::map<std::string, std::string> all;
  for (const std::string& key : section.keys()) {
    if (section.has(key)) all[key] = section.text(key);
  }
  return all;
}

void check_cameras(const Configuration& section, const std::map<std::string, std::string>& sources,
                   const std::vector<std::string>& cameras) {
  for (const auto& [camera, source] : sources) {
    if (std::find(cameras.begin(), cameras.end(), camera) != cameras.end()) continue;
    throw ConfigurationError(fmt::format("{}: '{}' is no camera of the configuration; expected {}",
                                         section.place(camera), camera, fmt::join(cameras, " or ")));
  }
}

}  // namespace

JointMapping JointMapping::from(const Configuration& import) {
  JointMapping mapping;
  mapping.in_degrees = import.choice_or("unit", "rad", {"rad", "deg"}) == "deg";
  const Configuration joints = import.section("joints");
  std::map<std::string, std::string> column_of_joint;
  for (const std::string& column : joints.keys()) {
    if (!joints.has(column)) continue;  // null: taken out again
    const JointMapping::Rule rule = read_rule(joints, column);
    if (!rule.joint.empty() && !column_of_joint.emplace(rule.joint, column).second) {
      joints.fail(column, "another joint than that of '" + column_of_joint[rule.joint] + "', each joint once");
    }
    mapping.joints.emplace(column, rule);
  }
  mapping.cameras = names(import.section("cameras"));
  mapping.masks = names(import.section("masks"));
  return mapping;
}

void JointMapping::check_names(const Configuration& import, const RobotModel& robot, const StereoRig& rig) const {
  std::vector<std::string> names, camera_names;
  for (const JointInfo& joint : robot.joints()) names.push_back(joint.name);
  for (const auto& [column, rule] : joints) {
    if (rule.joint.empty() || robot.find_joint(rule.joint)) continue;
    throw ConfigurationError(import.section("joints").place(column) + " is '" + rule.joint + "', no joint of robot '" +
                             robot.name() + "'; did you mean '" + nearest_name(rule.joint, names) + "'?");
  }
  for (const CameraModel& camera : rig.cameras) camera_names.push_back(camera.name);
  check_cameras(import.section("cameras"), cameras, camera_names);
  check_cameras(import.section("masks"), masks, camera_names);
}

}  // namespace bodyschema
