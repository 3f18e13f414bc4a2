#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "bodyschema/geometry/pose.hpp"

namespace bodyschema {

/// Where cameras were, as somebody published it: JSON with `base_link` and
/// `X_base_optical`: {METHOD: {CAMERA: 4x4}}, m, OpenCV axes.
struct CameraPoses {
  std::string base_link;
  std::string method;
  std::map<std::string, Pose> X_base_optical;  ///< by camera

  /// @param method  which of several; empty: the only one
  /// Throws FileError naming file and key, and the methods that are there where one must be chosen.
  static CameraPoses read(const std::filesystem::path& file, const std::string& method = "");
  /// The same for "FILE" or "FILE:METHOD", as on a command line.
  static CameraPoses from_argument(const std::string& argument);
};

/// A pose as it stands in a `cameras` section: `[[r, r, r, x], [r, r, r, y], [r, r, r, z], [0, 0, 0, 1]]`.
[[nodiscard]] std::string pose_yaml(const Pose& X);

}  // namespace bodyschema
