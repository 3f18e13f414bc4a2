#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace bodyschema {

/// Which link of a URDF hangs on which, which have a shape, and where their meshes are: what a configuration can be
/// written from before any mesh is read.
class UrdfOutline {
 public:
  struct Joint {
    std::string name, parent, child;
    bool movable = false;  ///< by itself: not fixed, no mimic
    bool fixed = false;
  };

  /// Throws FileError where the service could not load it: too large, nested too deep, no tree, and the like.
  explicit UrdfOutline(const std::filesystem::path& urdf);

  [[nodiscard]] const std::string& root() const { return root_; }
  /// Throws ConfigurationError naming the option and the nearest link for one that is not there.
  void require(const std::string& link, const std::string& option) const;
  /// Joints from the root down to a link.
  [[nodiscard]] std::vector<Joint> chain(std::string link) const;
  /// The link and what hangs on it, through fixed joints only or through all; joints that move by themselves.
  void collect(const std::string& link, bool only_fixed, std::vector<std::string>& links,
               std::vector<std::string>& joints) const;
  [[nodiscard]] bool slides(const std::string& joint) const { return sliding_.contains(joint); }
  [[nodiscard]] bool has_shape(const std::string& link) const { return with_shape_.contains(link); }
  [[nodiscard]] std::vector<std::string> movable_joints() const;
  /// Links that are named like cameras; where some are named optical, a frame with a camera's axes, these.
  [[nodiscard]] std::vector<std::string> named_like_cameras() const;

  struct Hand {
    std::string link;
    std::vector<std::string> others;  ///< links that could be meant as well
  };
  /// The end of the longest arm: the link with a shape behind the most joints that turn; where fingers begin, the link
  /// that they hang on. Throws FileError where no link with a shape is moved.
  /// @param recorded  joints: what others move is no part of an arm; empty, or where that leaves none: any
  [[nodiscard]] Hand guess_hand(const std::vector<std::string>& recorded) const;

  /// Folders outside the URDF's own in which the meshes of these links are: those of the packages they are in, above
  /// the URDF or by ROS's search paths, and those that links of the file system lead to.
  [[nodiscard]] std::vector<std::filesystem::path> mesh_roots(const std::vector<std::string>& links) const;

 private:
  [[nodiscard]] int turning_above(const std::string& link) const;
  [[nodiscard]] int moving_branches(const std::string& link) const;
  [[nodiscard]] int shapes_on(const std::string& link) const;
  [[nodiscard]] std::string follow_fixed(std::string link, const std::function<bool(const std::string&)>& wanted) const;

  std::filesystem::path urdf_;
  std::string root_;
  std::vector<std::string> names_;
  std::set<std::string> with_shape_;
  std::set<std::string> sliding_;                           ///< joints
  std::map<std::string, std::vector<std::string>> meshes_;  ///< file names as they stand in the URDF, by link
  std::map<std::string, Joint> above_;                      ///< by child
  std::map<std::string, std::vector<Joint>> below_;         ///< by parent
};

}  // namespace bodyschema
