#include "official_hand.hpp"

#include <tinyxml2.h>

#include <set>

#include "bodyschema/core/error.hpp"
#include "bodyschema/geometry/pose.hpp"
#include "bodyschema/robot/urdf_origin.hpp"

namespace bodyschema {
namespace {

namespace fs = std::filesystem;
using tinyxml2::XMLDocument;
using tinyxml2::XMLElement;

void load(XMLDocument& document, const fs::path& urdf) {
  if (document.LoadFile(urdf.c_str()) != tinyxml2::XML_SUCCESS) {
    throw FileError(urdf.string() + ": cannot be read as XML: " + document.ErrorStr());
  }
  if (document.FirstChildElement("robot") == nullptr) throw FileError(urdf.string() + ": has no <robot>");
}

std::string name_of(const XMLElement* element, const char* child) {
  const XMLElement* found = element->FirstChildElement(child);
  const char* name = found != nullptr ? found->Attribute("link") : nullptr;
  return name != nullptr ? name : "";
}

std::string name_of(const XMLElement* element) {
  const char* name = element->Attribute("name");
  return name != nullptr ? name : "";
}

Pose origin_of(const XMLElement* joint) {
  const XMLElement* origin = joint->FirstChildElement("origin");
  Pose X = Pose::Identity();
  if (origin == nullptr) return X;
  X.linear() = urdf_rotation(urdf_triple(origin->Attribute("rpy")));
  X.translation() = urdf_triple(origin->Attribute("xyz"));
  return X;
}

void set_origin(XMLElement* joint, const Pose& X) {
  XMLElement* origin = joint->InsertNewChildElement("origin");
  origin->SetAttribute("xyz", urdf_text(X.translation()).c_str());
  origin->SetAttribute("rpy", urdf_text(urdf_rpy(X.linear())).c_str());
}

/// Links beyond `root`, itself included.
std::set<std::string> links_beyond(const XMLElement* robot, const std::string& root) {
  std::set<std::string> links = {root};
  for (std::size_t before = 0; before != links.size();) {
    before = links.size();
    for (auto* joint = robot->FirstChildElement("joint"); joint; joint = joint->NextSiblingElement("joint")) {
      if (links.count(name_of(joint, "parent")) > 0) links.insert(name_of(joint, "child"));
    }
  }
  return links;
}

bool has_link(const XMLElement* robot, const std::string& name) {
  for (auto* link = robot->FirstChildElement("link"); link; link = link->NextSiblingElement("link")) {
    if (name_of(link) == name) return true;
  }
  return false;
}

/// Pose of `frame` in `root`, which a fixed joint ties together.
Pose pose_of_frame(const XMLElement* robot, const HandGraft& graft) {
  for (auto* joint = robot->FirstChildElement("joint"); joint; joint = joint->NextSiblingElement("joint")) {
    if (name_of(joint, "parent") == graft.hand_root && name_of(joint, "child") == graft.hand_frame) {
      return origin_of(joint);
    }
  }
  throw DataError(graft.hand_urdf.string() + ": no joint from '" + graft.hand_root + "' to '" + graft.hand_frame + "'");
}

}  // namespace

void write_grafted_urdf(const HandGraft& graft, const fs::path& out) {
  XMLDocument arm, hand;
  load(arm, graft.arm_urdf);
  load(hand, graft.hand_urdf);
  XMLElement* robot = arm.FirstChildElement("robot");
  const XMLElement* donor = hand.FirstChildElement("robot");
  if (!has_link(robot, graft.arm_link)) {
    throw DataError(graft.arm_urdf.string() + ": no link '" + graft.arm_link + "'");
  }

  const std::set<std::string> moved = links_beyond(donor, graft.hand_root);
  for (auto* link = donor->FirstChildElement("link"); link; link = link->NextSiblingElement("link")) {
    if (moved.count(name_of(link)) == 0) continue;
    auto* copy = robot->InsertEndChild(link->DeepClone(&arm))->ToElement();
    copy->SetAttribute("name", (graft.prefix + name_of(link)).c_str());
  }
  for (auto* joint = donor->FirstChildElement("joint"); joint; joint = joint->NextSiblingElement("joint")) {
    if (moved.count(name_of(joint, "parent")) == 0) continue;
    auto* copy = robot->InsertEndChild(joint->DeepClone(&arm))->ToElement();
    for (const char* end : {"parent", "child"}) {
      copy->FirstChildElement(end)->SetAttribute("link", (graft.prefix + name_of(joint, end)).c_str());
    }
  }

  Pose X = pose_of_frame(donor, graft).inverse(Eigen::Isometry);
  X.pretranslate(Eigen::Vector3d(0, 0, graft.along_z_m));
  XMLElement* weld = robot->InsertNewChildElement("joint");
  weld->SetAttribute("name", (graft.prefix + "weld").c_str());
  weld->SetAttribute("type", "fixed");
  weld->InsertNewChildElement("parent")->SetAttribute("link", graft.arm_link.c_str());
  weld->InsertNewChildElement("child")->SetAttribute("link", (graft.prefix + graft.hand_root).c_str());
  set_origin(weld, X);
  if (arm.SaveFile(out.c_str()) != tinyxml2::XML_SUCCESS) throw FileError(out.string() + ": cannot be written");
}

}  // namespace bodyschema
