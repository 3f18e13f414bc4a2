#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "bodyschema/geometry/pose.hpp"
#include "bodyschema/geometry/triangle_mesh.hpp"

namespace bodyschema {

struct JointInfo {
  std::string name;
  double lower_rad = 0.0;  ///< nominal limit (m for a sliding joint); -inf for continuous joints
  double upper_rad = 0.0;
  bool slides = false;  ///< prismatic: positions are m, not rad
  std::string parent_link;
  std::string child_link;
};

/// A rendered link's visual geometry in the link frame, welded and with its winding repaired where
/// that was possible; several visuals of one link are one mesh.
struct LinkMesh {
  std::string link;
  TriangleMesh mesh;
  bool closed = true;              ///< every edge has two triangles
  bool consistent_winding = true;  ///< neighbours agree; closed components face outward
};

/// A frame that the URDF does not have, fixed to one of its links or to another such frame given before it.
struct AddedFrame {
  std::string name;
  std::string parent;
  Pose X_PF = Pose::Identity();  ///< pose in the parent
};

struct RobotModelOptions {
  std::filesystem::path urdf;
  /// Searched in order for `package://name/rest` (as root/name/rest) and for relative paths that
  /// are not found beside the URDF.
  std::vector<std::filesystem::path> mesh_search_roots;
  /// Links whose visual meshes are loaded; all others are never opened.
  std::vector<std::string> rendered_links;
  /// Links of the loaded robot besides the URDF's; they have neither mass nor mesh.
  std::vector<AddedFrame> added_frames{};
};

/// A robot as its URDF describes it: joints, links, masses and the meshes of the rendered links.
/// Immutable after loading and safe to share between threads; per-thread scratch lives in
/// ForwardKinematics and GravityTorques.
///
/// Joint vectors everywhere in the project hold one value per entry of `joints()`, in that order,
/// in radians (metres for prismatic joints): the movable joints that do not mimic another, in
/// breadth-first order from the root. Mimic joints follow their driver by themselves.
class RobotModel {
 public:
  /// Throws FileError naming URDF or mesh and what is wrong with it (missing, not XML, a cycle, a
  /// link without mesh, an unknown rendered link with the nearest name, a mesh with no triangles).
  static std::shared_ptr<const RobotModel> load(const RobotModelOptions& options);
  ~RobotModel();

  [[nodiscard]] const std::string& name() const;
  [[nodiscard]] std::span<const JointInfo> joints() const;
  [[nodiscard]] Eigen::Index joint_count() const;
  /// Throws ConfigurationError naming the nearest joint when there is none of that name.
  [[nodiscard]] Eigen::Index joint_index(const std::string& name) const;
  [[nodiscard]] std::optional<Eigen::Index> find_joint(const std::string& name) const;
  [[nodiscard]] bool has_link(const std::string& name) const;
  [[nodiscard]] std::vector<std::string> link_names() const;
  [[nodiscard]] const std::string& root_link() const;
  /// In the order of RobotModelOptions::rendered_links.
  [[nodiscard]] std::span<const LinkMesh> meshes() const;
  /// One line per part that is not closed or was not consistently wound, naming link and file;
  /// empty when all is well.
  [[nodiscard]] std::span<const std::string> warnings() const;
  /// Whether the URDF gives any link a mass (gravity torques are meaningless otherwise).
  [[nodiscard]] bool has_masses() const;

  struct Impl;
  [[nodiscard]] const Impl& impl() const { return *impl_; }

 private:
  RobotModel();
  std::unique_ptr<Impl> impl_;
};

}  // namespace bodyschema
