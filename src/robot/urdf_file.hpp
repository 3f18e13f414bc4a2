#pragma once

#include <urdf_model/model.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace bodyschema {

/// A parsed URDF that is known to be one finite tree: a single root, every other link the child of
/// exactly one joint, no cycle, all numbers finite. `links` are in breadth-first order from the
/// root, so a parent always comes before its children.
struct UrdfTree {
  std::shared_ptr<const urdf::ModelInterface> model;
  std::vector<const urdf::Link*> links;
};

/// Reads and checks a URDF file. urdfdom's own messages are kept off the terminal and become part
/// of the error. One thread at a time (guarded inside; the message handler is global).
///
/// Throws FileError naming the file when it is missing, not a regular file, larger than 16 MiB,
/// nested deeper than 100 elements, of more than 2000 links, not a URDF, or not a tree.
UrdfTree read_urdf(const std::filesystem::path& file);

}  // namespace bodyschema
