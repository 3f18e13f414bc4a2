#include "urdf_file.hpp"

#include <console_bridge/console.h>
#include <urdf_parser/urdf_parser.h>

#include <cmath>
#include <fstream>
#include <map>
#include <mutex>
#include <set>
#include <sstream>
#include <string_view>

#include "bodyschema/core/error.hpp"
#include "xml_scan.hpp"

namespace bodyschema {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t kMaxUrdfBytes = 16u << 20;
constexpr int kMaxXmlDepth = 100;
constexpr int kMaxLinks = 2000;  // urdfdom's links hold each other, one level of recursion for each

/// Collects what urdfdom would print.
class MessageCollector : public console_bridge::OutputHandler {
 public:
  MessageCollector() : lock_(mutex()) { console_bridge::useOutputHandler(this); }
  ~MessageCollector() override { console_bridge::restorePreviousOutputHandler(); }
  void log(const std::string& text, console_bridge::LogLevel level, const char*, int) override {
    if (level == console_bridge::CONSOLE_BRIDGE_LOG_ERROR) errors_.push_back(text);
  }
  /// The first error is the specific one; later ones only say which element it spoilt.
  [[nodiscard]] std::string summary() const {
    if (errors_.empty()) return "it is not a URDF";
    std::string line = errors_.front();
    if (errors_.size() > 1) line += "; " + errors_[1];
    for (char& c : line) {
      if (c == '\n' || c == '\r') c = ' ';
    }
    return line;
  }

 private:
  static std::mutex& mutex() {
    static std::mutex m;
    return m;
  }
  std::unique_lock<std::mutex> lock_;
  std::vector<std::string> errors_;
};

std::string read_text(const fs::path& file) {
  std::error_code error;
  if (!fs::exists(file, error)) throw FileError(file.string() + ": URDF not found");
  if (!fs::is_regular_file(file, error)) {
    throw FileError(file.string() + ": expected a URDF file, this is not a regular file");
  }
  const auto size = fs::file_size(file, error);
  if (error) throw FileError(file.string() + ": cannot be read: " + error.message());
  if (size > kMaxUrdfBytes) {
    throw FileError(file.string() + ": URDF of " + std::to_string(size) + " bytes, at most " +
                    std::to_string(kMaxUrdfBytes) + " expected");
  }
  std::ifstream stream(file, std::ios::binary);
  std::string text(size, '\0');
  stream.read(text.data(), static_cast<std::streamsize>(size));
  if (!stream) throw FileError(file.string() + ": cannot be read");
  return text;
}

bool finite(const urdf::Vector3& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}
bool finite(const urdf::Pose& pose) {
  const auto& r = pose.rotation;
  return finite(pose.position) && std::isfinite(r.x) && std::isfinite(r.y) && std::isfinite(r.z) && std::isfinite(r.w);
}

void check_joint(const fs::path& file, const urdf::Joint& joint) {
  const auto fail = [&](const std::string& what) {
    throw FileError(file.string() + ": joint '" + joint.name + "': " + what);
  };
  if (!finite(joint.parent_to_joint_origin_transform)) fail("origin is not a finite number");
  const bool movable = joint.type == urdf::Joint::REVOLUTE || joint.type == urdf::Joint::CONTINUOUS ||
                       joint.type == urdf::Joint::PRISMATIC;
  if (movable) {
    if (!finite(joint.axis)) fail("axis is not a finite number");
    const double norm = std::hypot(joint.axis.x, joint.axis.y, joint.axis.z);
    if (norm < 1e-6) fail("axis is zero, expected a direction");
  }
  if (joint.limits && !(joint.limits->lower <= joint.limits->upper)) {
    std::ostringstream text;
    text << "limits [" << joint.limits->lower << ", " << joint.limits->upper << "], expected lower <= upper";
    fail(text.str());
  }
  if (joint.mimic && !(std::isfinite(joint.mimic->multiplier) && std::isfinite(joint.mimic->offset))) {
    fail("mimic multiplier or offset is not a finite number");
  }
}

void check_link(const fs::path& file, const urdf::Link& link) {
  if (!link.inertial) return;
  const auto& in = *link.inertial;
  if (!finite(in.origin) || !(in.mass >= 0.0) || !std::isfinite(in.mass) ||
      !std::isfinite(in.ixx + in.ixy + in.ixz + in.iyy + in.iyz + in.izz)) {
    throw FileError(file.string() + ": link '" + link.name +
                    "': inertial values must be finite and the mass not negative");
  }
}

/// Throws when a link is the child of two joints or its own ancestor, or there are too many. Done on the text:
/// urdfdom accepts such models; its shared pointers then keep cycles alive for ever, and long chains end the stack.
void check_tree(const fs::path& file, std::string_view text) {
  struct Above {
    std::string joint;
    std::string parent;
  };
  std::map<std::string, Above> above;  // by child link
  int depth = 0;
  int count[2] = {0, 0};  // of joints and of links
  std::string joint, parent, child;
  XmlScanner scanner(text);
  for (XmlTag tag; scanner.next(tag);) {
    const bool opens = tag.kind != XmlTag::Kind::kClose;
    if (opens && depth == 1 && (tag.name == "link" || tag.name == "joint") && ++count[tag.name == "link"] > kMaxLinks) {
      throw FileError(file.string() + ": more than " + std::to_string(kMaxLinks) + " " + std::string(tag.name) +
                      "s, too many for a robot");
    }
    if (opens && depth == 1 && tag.name == "joint") joint = tag.attribute("name");
    if (opens && depth == 2 && tag.name == "parent") parent = tag.attribute("link");
    if (opens && depth == 2 && tag.name == "child") child = tag.attribute("link");
    depth += tag.kind == XmlTag::Kind::kOpen ? 1 : tag.kind == XmlTag::Kind::kClose ? -1 : 0;
    if (depth != 1 || tag.name != "joint") continue;
    if (!child.empty()) {
      const auto [at, fresh] = above.emplace(child, Above{joint, parent});
      if (!fresh) {
        throw FileError(file.string() + ": link '" + child + "' is the child of joints '" + at->second.joint +
                        "' and '" + joint + "'; a URDF must be a tree without cycles");
      }
    }
    parent.clear();
    child.clear();
  }
  std::set<std::string> safe;  // links known to lead to a root
  for (const auto& [link, unused] : above) {
    std::set<std::string> path;
    for (auto at = above.find(link); at != above.end() && safe.count(at->first) == 0;
         at = above.find(at->second.parent)) {
      if (!path.insert(at->first).second) {
        throw FileError(file.string() + ": link '" + at->first +
                        "' is its own ancestor; a URDF must be a tree without cycles");
      }
    }
    safe.merge(path);
  }
}

}  // namespace

UrdfTree read_urdf(const fs::path& file) {
  const std::string text = read_text(file);
  // The XML parser below recurses once per level.
  if (const std::string danger = xml_danger(text, kMaxXmlDepth); !danger.empty()) {
    throw FileError(file.string() + ": not a usable URDF: " + danger);
  }
  check_tree(file, text);

  urdf::ModelInterfaceSharedPtr model;
  {
    MessageCollector messages;
    std::string reason;
    try {
      model = urdf::parseURDF(text);
      if (!model) reason = messages.summary();
    } catch (const std::exception& error) {
      reason = error.what();
    }
    if (!model) throw FileError(file.string() + ": not a usable URDF: " + reason);
  }

  UrdfTree tree;
  tree.links.push_back(model->root_link_.get());
  for (std::size_t i = 0; i < tree.links.size() && i < model->links_.size(); ++i) {
    for (const auto& child : tree.links[i]->child_links) tree.links.push_back(child.get());
  }
  if (tree.links.size() != model->links_.size()) {
    throw FileError(file.string() + ": its links are not one tree");
  }

  for (const auto& [name, joint] : model->joints_) check_joint(file, *joint);
  for (const auto& [name, link] : model->links_) check_link(file, *link);
  tree.model = model;
  return tree;
}

}  // namespace bodyschema
