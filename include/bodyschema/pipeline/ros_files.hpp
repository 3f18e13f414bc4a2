#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "bodyschema/camera/stereo_rig.hpp"
#include "bodyschema/pipeline/export_correction.hpp"

namespace bodyschema {

/// A camera as a result has it.
struct RosCamera {
  std::string name;
  PinholeIntrinsics intrinsics;        ///< px
  std::array<double, 5> distortion{};  ///< k1 k2 p1 p2 k3 as OpenCV
  std::string parent;                  ///< link, or another camera's frame; empty: the URDF places this camera
  Pose X_PC = Pose::Identity();        ///< in its parent, OpenCV axes, m
};

/// The frame of a camera that no link of the URDF is: "left_optical_frame".
[[nodiscard]] std::string ros_frame_of(const std::string& camera);

/// Cameras of a rig whose poses and intrinsics have been corrected.
[[nodiscard]] std::vector<RosCamera> ros_cameras_of(const StereoRig& rig);

/// Writes a result in the forms in which ROS reads it into `folder`:
///
///   joint_calibration.yaml        for xacro.load_yaml: of each joint that is corrected its offset, and x, y, z, roll,
///                                 pitch, yaw of its origin in `corrected_urdf`
///   camera_info/CAMERA.yaml       ROS's calibration file (camera_calibration_parsers)
///   static_transforms.sh          runs static_transform_publisher for each camera that is no link of the URDF
///   ros2_control_transmissions.xml   a transmission with <offset> for each joint that has one
///
/// The first and the last are two ways of the same correction: one of them is to be applied.
/// Throws FileError naming a URDF that cannot be read, and as replace_file. Returns the files, for people.
std::string write_ros_files(const std::filesystem::path& folder, const std::filesystem::path& urdf,
                            const std::filesystem::path& corrected_urdf, const Correction& correction,
                            const std::vector<RosCamera>& cameras);

}  // namespace bodyschema
