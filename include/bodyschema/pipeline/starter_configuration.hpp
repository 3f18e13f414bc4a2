#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace bodyschema {

struct StarterOptions {
  std::filesystem::path urdf;
  std::string hand_link;  ///< the end of the arm; empty: guessed, and said
  /// One or two URDF links with OpenCV axes, as LINK or CAMERA=LINK; without names they are the cameras of `stills` in
  /// their order, else left and right. Empty: where the cameras are is not known, and the configuration says so.
  std::vector<std::string> camera_links;
  std::vector<std::filesystem::path> camera_infos;  ///< ROS CameraInfo, in the order of the cameras
  std::filesystem::path stills;                     ///< folder of pictures and joint angles (StillsFolder); empty: none
  std::string camera_pose;                          ///< FILE or FILE:METHOD (CameraPoses); empty: not read
  bool rectified = false;                           ///< pictures are rectified ones: P of the camera_info counts
  int width = 640;                                  ///< px, of each picture, where neither stills nor infos say
  int height = 480;                                 ///< px
  double focal_px = 0.0;                            ///< 0: not known yet, a guess is written and said
  std::optional<bool> masks;                        ///< others send masks; absent: where `stills` has them
  std::string channel_prefix = "ROBOT";
  std::filesystem::path out;  ///< folder, created
};

struct StarterReport {
  std::string text;     ///< what was found, what was guessed, what is left to fill in; for people
  bool usable = false;  ///< robot and meshes load; otherwise the text says what must be put right
};

/// Writes robot.yaml, estimator.yaml and, where the cameras' places are known, simulator.yaml for a robot that has
/// none, from its URDF: the joints between root and hand that do not move the cameras too are the arm, the links they
/// carry are what the cameras see, and the base where it stands in their view or may do so; joints between root and a
/// camera are the head. Replaces no file. Throws FileError naming the URDF and what is wrong, ConfigurationError naming
/// a link that is not there and the nearest one, and as replace_file.
StarterReport write_starter_configuration(const StarterOptions& options);

}  // namespace bodyschema
