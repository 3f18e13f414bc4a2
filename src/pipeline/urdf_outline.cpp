#include "urdf_outline.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdlib>
#include <spdlog/fmt/fmt.h>
#include <sstream>
#include <tinyxml2.h>

#include "bodyschema/core/error.hpp"
#include "bodyschema/core/nearest_name.hpp"
#include "bodyschema/robot/robot_model.hpp"

namespace bodyschema {
namespace {

namespace fs = std::filesystem;
using tinyxml2::XMLElement;

constexpr const char* kNotAUrdf = "not a URDF (xacro files are converted first: xacro arm.urdf.xacro > arm.urdf)";

std::string attribute(const XMLElement* element, const char* name) {
  const char* text = element != nullptr ? element->Attribute(name) : nullptr;
  return text != nullptr ? text : "";
}

/// Whether xacro has still to make something of it; its namespace alone stands in many a file that it has made.
bool asks_for_xacro(const XMLElement& element) {
  if (std::string_view(element.Name()).starts_with("xacro:")) return true;
  for (auto* child = element.FirstChildElement(); child != nullptr; child = child->NextSiblingElement()) {
    if (asks_for_xacro(*child)) return true;
  }
  return false;
}

void check(const fs::path& urdf) {
  try {
    (void)RobotModel::load({urdf, {}, {}});
  } catch (const FileError& error) {
    const std::string why = error.what(), start = urdf.string() + ": not a usable URDF: ";
    if (!why.starts_with(start)) throw;
    throw FileError(urdf.string() + ": " + kNotAUrdf + ": " + why.substr(start.size()));
  }
}

/// Folders in which ROS looks for packages, by its environment variables.
std::vector<fs::path> ros_folders() {
  std::vector<fs::path> folders;
  for (const char* variable : {"AMENT_PREFIX_PATH", "ROS_PACKAGE_PATH"}) {
    const char* value = std::getenv(variable);
    std::stringstream list(value != nullptr ? value : "");
    for (std::string folder; std::getline(list, folder, ':');) {
      if (folder.empty()) continue;
      folders.push_back(variable[0] == 'A' ? fs::path(folder) / "share" : fs::path(folder));
    }
  }
  return folders;
}

bool lies_in(const fs::path& path, const fs::path& folder) {
  return std::mismatch(folder.begin(), folder.end(), path.begin(), path.end()).first == folder.end();
}

fs::path real(const fs::path& path) {
  std::error_code error;
  const fs::path found = fs::weakly_canonical(path, error);
  return error ? path.lexically_normal() : found;
}

/// The folder to allow for the sake of this mesh: its package, else the one called meshes, else its own.
fs::path folder_to_allow(const fs::path& mesh) {
  std::error_code none;
  for (fs::path folder = mesh.parent_path(); folder.has_relative_path(); folder = folder.parent_path()) {
    if (fs::exists(folder / "package.xml", none)) return folder;
  }
  for (fs::path folder = mesh.parent_path(); folder.has_relative_path(); folder = folder.parent_path()) {
    if (folder.filename() == "meshes") return folder;
  }
  return mesh.parent_path();
}

void add(std::vector<fs::path>& folders, const fs::path& folder) {
  if (std::find(folders.begin(), folders.end(), folder) == folders.end()) folders.push_back(folder);
}

}  // namespace

UrdfOutline::UrdfOutline(const fs::path& urdf) : urdf_(urdf) {
  tinyxml2::XMLDocument document;
  const auto error = document.LoadFile(urdf.c_str());
  const XMLElement* robot = document.FirstChildElement("robot");
  if (robot != nullptr && asks_for_xacro(*robot)) throw FileError(urdf.string() + ": " + kNotAUrdf);
  check(urdf);
  if (error != tinyxml2::XML_SUCCESS || robot == nullptr) throw FileError(urdf.string() + ": " + kNotAUrdf);
  for (auto* link = robot->FirstChildElement("link"); link != nullptr; link = link->NextSiblingElement("link")) {
    names_.push_back(attribute(link, "name"));
    for (auto* visual = link->FirstChildElement("visual"); visual != nullptr;
         visual = visual->NextSiblingElement("visual")) {
      with_shape_.insert(names_.back());
      const auto* geometry = visual->FirstChildElement("geometry");
      const auto* mesh = geometry != nullptr ? geometry->FirstChildElement("mesh") : nullptr;
      if (mesh != nullptr) meshes_[names_.back()].push_back(attribute(mesh, "filename"));
    }
  }
  for (auto* element = robot->FirstChildElement("joint"); element != nullptr;
       element = element->NextSiblingElement("joint")) {
    Joint joint{attribute(element, "name"), attribute(element->FirstChildElement("parent"), "link"),
                attribute(element->FirstChildElement("child"), "link"), false, attribute(element, "type") == "fixed"};
    joint.movable = !joint.fixed && element->FirstChildElement("mimic") == nullptr;
    if (attribute(element, "type") == "prismatic") sliding_.insert(joint.name);
    above_[joint.child] = joint;
    below_[joint.parent].push_back(joint);
  }
  for (const auto& name : names_) {
    if (!above_.contains(name)) root_ = name;
  }
}

void UrdfOutline::require(const std::string& link, const std::string& option) const {
  if (std::find(names_.begin(), names_.end(), link) != names_.end()) return;
  throw ConfigurationError(fmt::format("{} '{}': no such link in {}; did you mean '{}'?", option, link, urdf_.string(),
                                       nearest_name(link, names_)));
}

std::vector<UrdfOutline::Joint> UrdfOutline::chain(std::string link) const {
  std::vector<Joint> joints;
  for (auto at = above_.find(link); at != above_.end(); at = above_.find(link)) {
    if (joints.size() > above_.size()) throw FileError(urdf_.string() + ": link '" + link + "' hangs on itself");
    joints.insert(joints.begin(), at->second);
    link = at->second.parent;
  }
  return joints;
}

void UrdfOutline::collect(const std::string& link, bool only_fixed, std::vector<std::string>& links,
                          std::vector<std::string>& joints) const {
  if (std::find(links.begin(), links.end(), link) != links.end()) return;
  links.push_back(link);
  const auto at = below_.find(link);
  if (at == below_.end()) return;
  for (const auto& joint : at->second) {
    if (only_fixed && !joint.fixed) continue;
    if (joint.movable) joints.push_back(joint.name);
    collect(joint.child, only_fixed, links, joints);
  }
}

std::vector<std::string> UrdfOutline::movable_joints() const {
  std::vector<std::string> joints;
  for (const auto& [child, joint] : above_) {
    if (joint.movable) joints.push_back(joint.name);
  }
  return joints;
}

int UrdfOutline::turning_above(const std::string& link) const {
  const auto joints = chain(link);
  return static_cast<int>(std::count_if(joints.begin(), joints.end(),
                                        [&](const Joint& joint) { return joint.movable && !slides(joint.name); }));
}

std::vector<std::string> UrdfOutline::named_like_cameras() const {
  constexpr std::array kNames = {"camera", "_eye", "realsense", "d415", "d435", "d455", "zed", "kinect", "xtion"};
  std::vector<std::string> cameras, optical;
  for (const auto& link : names_) {
    std::string name = link;
    std::transform(name.begin(), name.end(), name.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    const auto has = [&](const char* part) { return name.find(part) != std::string::npos; };
    if (has("optical")) {
      optical.push_back(link);
    } else if (std::any_of(kNames.begin(), kNames.end(), has)) {
      cameras.push_back(link);
    }
  }
  return optical.empty() ? cameras : optical;
}

/// Joints that move, by themselves or as mimics, and begin at this link or one fixed to it.
int UrdfOutline::moving_branches(const std::string& link) const {
  std::vector<std::string> body, unused;
  collect(link, true, body, unused);
  int branches = 0;
  for (const auto& part : body) {
    const auto at = below_.find(part);
    if (at == below_.end()) continue;
    branches += static_cast<int>(
        std::count_if(at->second.begin(), at->second.end(), [](const Joint& joint) { return !joint.fixed; }));
  }
  return branches;
}

/// Links with a shape that are fixed to this one, itself included.
int UrdfOutline::shapes_on(const std::string& link) const {
  std::vector<std::string> body, unused;
  collect(link, true, body, unused);
  return static_cast<int>(std::count_if(body.begin(), body.end(), [&](const auto& part) { return has_shape(part); }));
}

/// Down along fixed joints while one branch alone is wanted.
std::string UrdfOutline::follow_fixed(std::string link, const std::function<bool(const std::string&)>& wanted) const {
  for (auto at = below_.find(link); at != below_.end(); at = below_.find(link)) {
    std::vector<std::string> next;
    for (const Joint& joint : at->second) {
      if (joint.fixed && wanted(joint.child)) next.push_back(joint.child);
    }
    if (next.size() != 1) break;
    link = next.front();
  }
  return link;
}

UrdfOutline::Hand UrdfOutline::guess_hand(const std::vector<std::string>& recorded) const {
  // A link on a joint that slides, and behind which nothing turns, is a finger of a gripper.
  const auto behind_slider = [&](const std::string& link) {
    const auto joints = chain(link);
    const auto last = std::find_if(joints.rbegin(), joints.rend(), [](const Joint& joint) { return !joint.fixed; });
    return last != joints.rend() && slides(last->name);
  };
  const auto is_recorded = [&](const Joint& joint) {
    return !joint.movable || recorded.empty() ||
           std::find(recorded.begin(), recorded.end(), joint.name) != recorded.end();
  };
  int most = 0;
  std::vector<std::string> candidates;
  for (const auto& link : names_) {
    const auto joints = chain(link);
    if (!has_shape(link) || behind_slider(link) || !std::all_of(joints.begin(), joints.end(), is_recorded)) continue;
    candidates.push_back(link);
    most = std::max(most, turning_above(link));
  }
  if (most == 0 && !recorded.empty()) return guess_hand({});
  if (most == 0) {
    throw FileError(urdf_.string() +
                    ": no link with a <visual> shape is moved by a joint that turns; say which is "
                    "the hand (--hand)");
  }
  std::vector<std::string> ends;
  for (const auto& link : candidates) {
    if (turning_above(link) != most) continue;
    // Where several joints begin, more of the arm being above than below, a hand ends and fingers begin.
    std::string hand;
    const auto moves_fingers = [&](const std::string& part) { return moving_branches(part) >= 2; };
    for (const Joint& joint : chain(link)) {
      if (joint.movable) hand = joint.child;  // where no fingers begin: what the last joint carries
      const int above = turning_above(joint.child);
      if (!moves_fingers(joint.child) || above < most - above) continue;
      hand = follow_fixed(joint.child, moves_fingers);
      break;
    }
    if (!moves_fingers(hand)) {
      hand = follow_fixed(hand, [&](const std::string& part) { return shapes_on(part) > 0; });
    }
    while (!has_shape(hand) && above_.contains(hand)) hand = above_.at(hand).parent;
    if (std::find(ends.begin(), ends.end(), hand) == ends.end()) ends.push_back(hand);
  }
  return {ends.front(), {ends.begin() + 1, ends.end()}};
}

std::vector<fs::path> UrdfOutline::mesh_roots(const std::vector<std::string>& links) const {
  std::error_code none;
  const fs::path urdf = fs::absolute(urdf_).lexically_normal();
  const fs::path own = real(urdf.parent_path());
  std::vector<fs::path> roots;   // as they are searched
  std::vector<fs::path> behind;  // where links of the file system lead
  for (const auto& link : links) {
    const auto names = meshes_.find(link);
    if (names == meshes_.end()) continue;
    for (const std::string& name : names->second) {
      fs::path mesh;
      if (name.starts_with("package://") || name.starts_with("model://")) {
        const std::string rest = name.substr(name.find("://") + 3);
        std::vector<fs::path> candidates;
        for (const fs::path& from : {urdf, real(urdf)}) {
          for (fs::path folder = from.parent_path(); folder.has_relative_path(); folder = folder.parent_path()) {
            candidates.push_back(folder);
          }
        }
        for (const auto& folder : ros_folders()) candidates.push_back(folder);
        const auto holds = std::find_if(candidates.begin(), candidates.end(),
                                        [&](const fs::path& folder) { return fs::exists(folder / rest, none); });
        if (holds == candidates.end()) continue;  // said where the robot is loaded
        add(roots, *holds);
        mesh = *holds / rest;
      } else {
        const std::string rest = name.starts_with("file://") ? name.substr(7) : name;
        mesh = urdf.parent_path() / rest;
        if (!fs::exists(mesh, none)) continue;
      }
      const fs::path place = real(mesh);
      const auto allowed = [&](const fs::path& folder) { return lies_in(place, real(folder)); };
      if (lies_in(place, own) || std::any_of(roots.begin(), roots.end(), allowed)) continue;
      add(behind, folder_to_allow(place));
    }
  }
  for (const fs::path& folder : behind) add(roots, folder);
  return roots;
}

}  // namespace bodyschema
