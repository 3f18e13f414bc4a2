#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace bodyschema {

struct StarterOptions {
  std::filesystem::path urdf;
  std::string hand_link;                  ///< the end of the arm
  std::vector<std::string> camera_links;  ///< one or two, left first; OpenCV axes
  int width = 640;                        ///< px, of each picture
  int height = 480;                       ///< px
  double focal_px = 0.0;                  ///< 0: not known yet, a guess is written and said
  std::string channel_prefix = "ROBOT";
  std::filesystem::path out;  ///< folder, created
};

/// Writes robot.yaml, estimator.yaml and simulator.yaml for a robot that has none, from its URDF: the
/// joints between root and hand that do not move the cameras too are the arm, the links they carry are
/// what the cameras see, joints between root and a camera are the head. Says what was found and
/// what is left to fill in, for people. Replaces no file. Throws FileError naming the URDF and what
/// is wrong, ConfigurationError naming a link that is not there and the nearest one, and as replace_file.
std::string write_starter_configuration(const StarterOptions& options);

}  // namespace bodyschema
