#include "robot/urdf_walk.hpp"

#include <cmath>
#include <fstream>
#include <sstream>
#include <stdexcept>

namespace bodyschema {
namespace {

/// The value of an attribute of the first element `element` in `xml`; empty when absent.
std::string attribute(const std::string& xml, const std::string& element, const std::string& name) {
  auto at = xml.find("<" + element + " ");
  if (at == std::string::npos) return {};
  const std::string tag = xml.substr(at, xml.find('>', at) - at);
  at = tag.find(" " + name + "=\"");
  if (at == std::string::npos) return {};
  at += name.size() + 3;
  return tag.substr(at, tag.find('"', at) - at);
}

Eigen::Vector3d vector(const std::string& text, const Eigen::Vector3d& fallback) {
  if (text.empty()) return fallback;
  std::istringstream stream(text);
  Eigen::Vector3d v;
  stream >> v.x() >> v.y() >> v.z();
  return v;
}

double number(const std::string& text, double fallback) {
  return text.empty() ? fallback : std::stod(text);
}

/// Rodrigues' formula.
Eigen::Matrix3d rotation(Eigen::Vector3d axis, double angle) {
  axis /= std::sqrt(axis.dot(axis));
  Eigen::Matrix3d K;
  K << 0, -axis.z(), axis.y(), axis.z(), 0, -axis.x(), -axis.y(), axis.x(), 0;
  return Eigen::Matrix3d::Identity() + std::sin(angle) * K + (1 - std::cos(angle)) * K * K;
}

Eigen::Matrix4d transform(const Eigen::Matrix3d& R, const Eigen::Vector3d& p) {
  Eigen::Matrix4d X = Eigen::Matrix4d::Identity();
  X.topLeftCorner<3, 3>() = R;
  X.topRightCorner<3, 1>() = p;
  return X;
}

}  // namespace

UrdfWalk::UrdfWalk(const std::filesystem::path& urdf) {
  std::ifstream stream(urdf);
  if (!stream) throw std::runtime_error("cannot open " + urdf.string());
  const std::string text((std::istreambuf_iterator<char>(stream)), {});
  for (auto at = text.find("<joint "); at != std::string::npos; at = text.find("<joint ", at + 1)) {
    const std::string block = text.substr(at, text.find("</joint>", at) - at);
    Joint joint;
    joint.name = attribute(block, "joint", "name");
    joint.type = attribute(block, "joint", "type");
    if (joint.type.empty()) continue;  // a reference inside another element
    joint.parent = attribute(block, "parent", "link");
    joint.child = attribute(block, "child", "link");
    joint.xyz = vector(attribute(block, "origin", "xyz"), Eigen::Vector3d::Zero());
    joint.rpy = vector(attribute(block, "origin", "rpy"), Eigen::Vector3d::Zero());
    joint.axis = vector(attribute(block, "axis", "xyz"), Eigen::Vector3d::UnitX());
    joint.mimic = attribute(block, "mimic", "joint");
    joint.multiplier = number(attribute(block, "mimic", "multiplier"), 1.0);
    joint.offset = number(attribute(block, "mimic", "offset"), 0.0);
    joint_of_child_[joint.child] = joint;
  }
  for (auto at = text.find("<link "); at != std::string::npos; at = text.find("<link ", at + 1)) {
    const auto tag_end = text.find('>', at);
    if (text[tag_end - 1] == '/') continue;
    const std::string block = text.substr(at, text.find("</link>", at) - at);
    const auto inertial = block.find("<inertial>");
    if (inertial == std::string::npos) continue;
    const std::string part = block.substr(inertial, block.find("</inertial>") - inertial);
    masses_[attribute(block, "link", "name")] = {number(attribute(part, "mass", "value"), 0.0),
                                                 vector(attribute(part, "origin", "xyz"), Eigen::Vector3d::Zero())};
  }
}

Eigen::Matrix4d UrdfWalk::pose(const std::string& link, const std::map<std::string, double>& q) const {
  const auto at = joint_of_child_.find(link);
  if (at == joint_of_child_.end()) return Eigen::Matrix4d::Identity();
  const Joint& joint = at->second;
  const auto value = [&](const std::string& name) {
    const auto found = q.find(name);
    return found == q.end() ? 0.0 : found->second;
  };
  const double angle = joint.mimic.empty() ? value(joint.name) : joint.multiplier * value(joint.mimic) + joint.offset;
  Eigen::Matrix4d X = pose(joint.parent, q);
  X = X * transform(rotation({0, 0, 1}, joint.rpy.z()) * rotation({0, 1, 0}, joint.rpy.y()) *
                        rotation({1, 0, 0}, joint.rpy.x()),
                    joint.xyz);
  if (joint.type == "revolute" || joint.type == "continuous") {
    X = X * transform(rotation(joint.axis, angle), Eigen::Vector3d::Zero());
  } else if (joint.type == "prismatic") {
    X = X * transform(Eigen::Matrix3d::Identity(), angle * joint.axis.normalized());
  }
  return X;
}

Eigen::Vector3d UrdfWalk::centre_of_mass(const std::string& link, const std::map<std::string, double>& q) const {
  const Eigen::Vector4d p = pose(link, q) * masses_.at(link).p_L.homogeneous();
  return p.head<3>();
}

}  // namespace bodyschema
