#include "bodyschema/pipeline/starter_configuration.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <spdlog/fmt/fmt.h>
#include <tinyxml2.h>

#include "bodyschema/core/configuration.hpp"
#include "bodyschema/core/error.hpp"
#include "bodyschema/core/nearest_name.hpp"
#include "bodyschema/core/write_file.hpp"
#include "bodyschema/pipeline/pipeline.hpp"
#include "bodyschema/robot/robot_model.hpp"

namespace bodyschema {
namespace {

namespace fs = std::filesystem;
using tinyxml2::XMLElement;

constexpr double kGuessedFieldOfView_rad = 1.05;  // 60 deg across, a common camera

struct Joint {
  std::string name, parent, child;
  bool movable = false;  ///< by itself: not fixed, no mimic
  bool fixed = false;
};

std::string attribute(const XMLElement* element, const char* name) {
  const char* text = element != nullptr ? element->Attribute(name) : nullptr;
  return text != nullptr ? text : "";
}

/// NAME of package://NAME/...; empty: another kind of name.
std::string package_of(const std::string& mesh) {
  static const std::string kScheme = "package://";
  if (mesh.rfind(kScheme, 0) != 0) return "";
  return mesh.substr(kScheme.size(), mesh.find('/', kScheme.size()) - kScheme.size());
}

constexpr const char* kNotAUrdf = "not a URDF (xacro files are converted first: xacro arm.urdf.xacro > arm.urdf)";

/// Throws where the service could not load it: too large, nested too deep, no tree, and the like.
void check(const fs::path& urdf) {
  try {
    (void)RobotModel::load({urdf, {}, {}});
  } catch (const FileError& error) {
    const std::string why = error.what(), start = urdf.string() + ": not a usable URDF: ";
    if (!why.starts_with(start)) throw;
    throw FileError(urdf.string() + ": " + kNotAUrdf + ": " + why.substr(start.size()));
  }
}

/// Which link hangs on which, and which have a shape.
class Tree {
 public:
  explicit Tree(const fs::path& urdf) : urdf_(urdf) {
    check(urdf);
    tinyxml2::XMLDocument document;
    const auto error = document.LoadFile(urdf.c_str());
    const XMLElement* robot = document.FirstChildElement("robot");
    if (error != tinyxml2::XML_SUCCESS || robot == nullptr) {
      throw FileError(urdf.string() + ": " + kNotAUrdf);
    }
    for (auto* link = robot->FirstChildElement("link"); link != nullptr; link = link->NextSiblingElement("link")) {
      names_.push_back(attribute(link, "name"));
      for (auto* visual = link->FirstChildElement("visual"); visual != nullptr;
           visual = visual->NextSiblingElement("visual")) {
        with_shape_.insert(names_.back());
        const auto* geometry = visual->FirstChildElement("geometry");
        const auto* mesh = geometry != nullptr ? geometry->FirstChildElement("mesh") : nullptr;
        if (const auto package = package_of(attribute(mesh, "filename")); !package.empty()) packages_.insert(package);
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
  }

  void require(const std::string& link, const std::string& option) const {
    if (std::find(names_.begin(), names_.end(), link) != names_.end()) return;
    throw ConfigurationError(fmt::format("{} '{}': no such link in {}; did you mean '{}'?", option, link,
                                         urdf_.string(), nearest_name(link, names_)));
  }
  /// From the root down to a link.
  [[nodiscard]] std::vector<Joint> chain(std::string link) const {
    std::vector<Joint> joints;
    for (auto at = above_.find(link); at != above_.end(); at = above_.find(link)) {
      if (joints.size() > above_.size()) throw FileError(urdf_.string() + ": link '" + link + "' hangs on itself");
      joints.insert(joints.begin(), at->second);
      link = at->second.parent;
    }
    return joints;
  }
  /// The link and what hangs on it, through fixed joints only or through all.
  void collect(const std::string& link, bool only_fixed, std::vector<std::string>& links,
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
  [[nodiscard]] bool slides(const std::string& joint) const { return sliding_.contains(joint); }
  [[nodiscard]] bool has_shape(const std::string& link) const { return with_shape_.contains(link); }
  /// Folders above the URDF that hold the packages its meshes are in, as in a ROS workspace.
  [[nodiscard]] std::vector<fs::path> mesh_roots() const {
    std::vector<fs::path> roots;
    for (const auto& package : packages_) {
      fs::path folder = fs::absolute(urdf_).lexically_normal().parent_path();
      std::error_code ignored;
      while (folder.has_relative_path() && !fs::is_directory(folder / package, ignored)) folder = folder.parent_path();
      if (!fs::is_directory(folder / package, ignored)) continue;
      if (std::find(roots.begin(), roots.end(), folder) == roots.end()) roots.push_back(folder);
    }
    return roots;
  }

 private:
  fs::path urdf_;
  std::vector<std::string> names_;
  std::set<std::string> with_shape_;
  std::set<std::string> sliding_;                    ///< joints
  std::set<std::string> packages_;                   ///< named by the meshes
  std::map<std::string, Joint> above_;               ///< by child
  std::map<std::string, std::vector<Joint>> below_;  ///< by parent
};

std::string yaml(const std::string& name) {
  static constexpr const char* kPlain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_./-";
  if (!name.empty() && name.find_first_not_of(kPlain) == std::string::npos && name[0] != '-') return name;
  std::string text = "\"";
  for (const char c : name) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20 || byte == 0x7f) {
      text += fmt::format("\\x{:02x}", byte);
    } else {
      if (c == '"' || c == '\\') text += '\\';
      text += c;
    }
  }
  return text + "\"";
}

std::string list(const std::vector<std::string>& names) {
  std::vector<std::string> quoted;
  for (const auto& name : names) quoted.push_back(yaml(name));
  return fmt::format("[{}]", fmt::join(quoted, ", "));
}

/// What of a robot matters here.
struct Parts {
  std::vector<std::string> arm, head, others, rendered;
  std::vector<std::string> others_m;  ///< those of the others that slide
};

Parts parts_of(const Tree& tree, const StarterOptions& options) {
  std::vector<std::string> camera_joints;
  for (const auto& camera : options.camera_links) {
    for (const auto& joint : tree.chain(camera)) {
      if (joint.movable) camera_joints.push_back(joint.name);
    }
  }
  const auto in = [](const std::vector<std::string>& names, const std::string& name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  Parts parts;
  std::vector<std::string> links;
  std::vector<std::string> shared;
  const auto arm = tree.chain(options.hand_link);
  for (const auto& joint : arm) {
    if (joint.movable) (in(camera_joints, joint.name) ? shared : parts.arm).push_back(joint.name);
    std::vector<std::string> none;
    if (!parts.arm.empty()) tree.collect(joint.child, true, links, none);
  }
  // What hangs on the hand comes last, whether it is fixed there or moves.
  std::vector<std::string> hand;
  tree.collect(options.hand_link, false, hand, parts.others);
  std::erase_if(links, [&](const auto& link) { return in(hand, link); });
  links.insert(links.end(), hand.begin(), hand.end());
  std::set<std::string> seen;
  for (const auto& link : links) {
    if (tree.has_shape(link) && seen.insert(link).second) parts.rendered.push_back(link);
  }
  for (const auto& joint : camera_joints) {
    if (!in(shared, joint) && !in(parts.head, joint)) parts.head.push_back(joint);
  }
  parts.others.insert(parts.others.begin(), shared.begin(), shared.end());
  const auto slides = [&](const std::string& joint) { return tree.slides(joint); };
  // Published like any other, but no offset of them is estimated.
  std::erase_if(parts.arm, slides);
  std::erase_if(parts.head, slides);
  std::copy_if(parts.others.begin(), parts.others.end(), std::back_inserter(parts.others_m), slides);
  std::erase_if(parts.others, slides);
  return parts;
}

std::string robot_yaml(const StarterOptions& options, const Parts& parts, const std::vector<fs::path>& mesh_roots,
                       double focal_px) {
  const auto from_here = [&](const fs::path& path) {
    return fs::proximate(fs::absolute(path), fs::absolute(options.out)).string();
  };
  std::vector<std::string> roots;
  for (const auto& root : mesh_roots) roots.push_back(from_here(root));
  std::string text = fmt::format(
      "# Written from {}; every key is explained in config/icub_right/robot.yaml.\n"
      "version: 1\n\nrobot:\n  urdf: {}\n"
      "  mesh_search_roots: {}             # folders in which package://... is looked for\n"
      "  # What the cameras see moving; leave out what is always hidden.\n"
      "  rendered_links: {}\n  hand_link: {}\n"
      "  fingertip_links: []               # links at the fingertips, for errors there\n"
      "  estimated_joints: {}\n",
      yaml(options.urdf.filename().string()), yaml(from_here(options.urdf)), list(roots), list(parts.rendered),
      yaml(options.hand_link), list(parts.arm));
  if (!parts.head.empty()) text += fmt::format("  head_joints: {}\n", list(parts.head));
  const auto fix = [&](const char* unit, const std::vector<std::string>& joints) {
    if (joints.empty()) return;
    text += fmt::format("  # {0}; take out the joints that the robot publishes.\n  fixed_joints_{0}:\n", unit);
    for (const auto& joint : joints) text += fmt::format("    {}: 0\n", yaml(joint));
  };
  fix("deg", parts.others);
  fix("m", parts.others_m);
  text +=
      "  gravity_m_s2: [0, 0, -9.81]       # root frame\n\n"
      "# Focal lengths fx, fy and principal point cx, cy in px; distortion k1 k2 p1 p2 k3: "
      "OpenCV's calibration.\n"
      "cameras:\n";
  static constexpr const char* kNames[] = {"left", "right"};
  for (std::size_t c = 0; c < options.camera_links.size(); ++c) {
    text += fmt::format(
        "  {}:\n    link: {}\n    width: {}\n    height: {}\n    fx: {:.6g}\n    fy: {:.6g}\n    "
        "cx: {}\n    cy: {}\n"
        "    distortion: [0, 0, 0, 0, 0]\n",
        kNames[c], yaml(options.camera_links[c]), options.width, options.height, focal_px, focal_px,
        0.5 * (options.width - 1), 0.5 * (options.height - 1));
  }
  return text;
}

std::string estimator_yaml(const StarterOptions& options) {
  return fmt::format(
      "# The included files of config/ are the installed ones and explain every key.\n"
      "include: [config/estimator.yaml, config/bus.yaml, config/vision.yaml, "
      "robot.yaml]\n"
      "vision:\n"
      "  method: statistics                # or single_colour, learned_background: "
      "docs/calibrate_my_robot.md\n"
      "bus:\n"
      "  channel_prefix: {}\n",
      yaml(options.channel_prefix));
}

/// The distances of the motion are left out: the simulator finds them.
std::string simulator_yaml(const StarterOptions& options) {
  return fmt::format(
      "# A stand-in for the robot, played by bodyschema-sim; every key is explained in\n"
      "# config/icub_right/simulator.yaml.\n"
      "include: [config/bus.yaml, robot.yaml]\n"
      "bus:\n"
      "  channel_prefix: {}\n"
      "simulator:\n"
      "  cameras:\n"
      "    rate_hz: 30\n"
      "  motion:\n"
      "    posture_deg: {{}}                 # of head and fingers; left out: robot.fixed_joints_deg, else 0\n"
      "    hand_radius_m: 0.1              # m; kept inside the pictures around the hand\n",
      yaml(options.channel_prefix));
}

void write_new(const fs::path& file, const std::string& text) {
  std::error_code ignored;
  if (fs::exists(file, ignored)) throw FileError(file.string() + ": is there already and is not replaced");
  replace_file(file, text);  // on a full disk nothing half done stands in the way of the next try
}

}  // namespace

std::string write_starter_configuration(const StarterOptions& options) {
  const Tree tree(options.urdf);
  tree.require(options.hand_link, "--hand");
  for (const auto& camera : options.camera_links) tree.require(camera, "--camera");
  const Parts parts = parts_of(tree, options);
  if (parts.arm.empty()) {
    throw ConfigurationError(fmt::format("--hand '{}': no joint moves it against the cameras", options.hand_link));
  }
  if (parts.rendered.empty()) throw FileError(options.urdf.string() + ": no link of the arm has a <visual> shape");

  const double focal_px =
      options.focal_px > 0.0 ? options.focal_px : 0.5 * options.width / std::tan(0.5 * kGuessedFieldOfView_rad);
  make_folder(options.out);
  write_new(options.out / "robot.yaml", robot_yaml(options, parts, tree.mesh_roots(), focal_px));
  write_new(options.out / "estimator.yaml", estimator_yaml(options));
  write_new(options.out / "simulator.yaml", simulator_yaml(options));

  std::string told = fmt::format("arm: {}\n", fmt::join(parts.arm, ", "));
  if (!parts.head.empty()) told += fmt::format("head: {}\n", fmt::join(parts.head, ", "));
  auto fixed = parts.others;
  fixed.insert(fixed.end(), parts.others_m.begin(), parts.others_m.end());
  if (!fixed.empty()) {
    told += fmt::format("taken as fixed at 0 unless you take them out: {}\n", fmt::join(fixed, ", "));
  }
  told += fmt::format("seen: {}\n", fmt::join(parts.rendered, ", "));
  if (options.focal_px <= 0.0) {
    told += fmt::format("focal length: a guess, {:.0f} px; fill in your cameras' in robot.yaml\n", focal_px);
  }
  told += fmt::format("wrote robot.yaml, estimator.yaml and simulator.yaml in {}\n", options.out.string());
  try {
    const Pipeline pipeline(Configuration::load(options.out / "estimator.yaml"));
    told += "robot and meshes load\n";
  } catch (const Error& e) {
    told += fmt::format("to be put right: {}\n", e.what());
  }
  return told;
}

}  // namespace bodyschema
