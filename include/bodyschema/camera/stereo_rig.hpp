#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "bodyschema/core/configuration.hpp"
#include "bodyschema/geometry/binary_mask.hpp"
#include "bodyschema/geometry/image.hpp"
#include "bodyschema/geometry/pinhole.hpp"
#include "bodyschema/geometry/pose.hpp"
#include "bodyschema/robot/robot_setup.hpp"

namespace bodyschema {

/// What is known of a camera's place before anything has been estimated.
enum class PlaceKnowledge {
  kExact,    ///< to be taken as it is: a simulator's
  kKnown,    ///< as well as a good calibration knows it: to 1 mm and 0.1 deg, more or less
  kRoughly,  ///< up to errors of the standard deviations that are given
  kUnknown,  ///< nothing: to be found
};

/// Where a camera is fixed.
struct CameraMount {
  /// What carries it: a link of the URDF or, where it is `relative`, `CameraModel::link` of the rig's first camera.
  std::string parent;
  bool relative = false;         ///< to the rig's first camera
  Pose X_PC = Pose::Identity();  ///< the camera in its parent; identity where nothing is given
  PlaceKnowledge knowledge = PlaceKnowledge::kExact;
  Eigen::Vector3d sd_rad = Eigen::Vector3d::Zero();  ///< kKnown, kRoughly: of its rotation about each of its own axes
  Eigen::Vector3d sd_m = Eigen::Vector3d::Zero();    ///< kKnown, kRoughly: of its position along each of them
};

/// One camera: where it sits on the robot and how it maps directions to pixels.
struct CameraModel {
  std::string name;  ///< as configured: "left", "head"
  /// Frame with OpenCV axes (x right, y down, z forward) of the robot that load_robot() gives: `mount.parent` itself
  /// where that is a link with these axes, else a frame of its own.
  std::string link;
  PinholeIntrinsics intrinsics;        ///< px
  std::array<double, 5> distortion{};  ///< k1 k2 p1 p2 k3 as OpenCV; all zero: none
  int image_type = -1;                 ///< see number(); negative: not given
  CameraMount mount;
  std::string place;  ///< where its link is configured: Configuration::place
  [[nodiscard]] bool has_distortion() const;
  /// Its number in messages (bot_core::images_t::image_types): as given, else 1 for "right" and 0 for any other.
  [[nodiscard]] int number() const;
};

/// One camera or two, of any names, in the order of their numbers in messages: of a pair that calls itself left and
/// right the left one first.
struct StereoRig {
  std::vector<CameraModel> cameras;
  /// Reads the `cameras` section; config/icub_right/robot.yaml explains every key. Throws ConfigurationError.
  static StereoRig from(const Configuration& cameras);
  [[nodiscard]] std::vector<PinholeIntrinsics> intrinsics() const;
  /// Of the robot, each camera's.
  [[nodiscard]] std::vector<std::string> links() const;
};

/// RobotSetup::load with a frame for every camera that is no link of the URDF by itself. Throws as that does, and
/// ConfigurationError naming file, key, link and the nearest one for a camera on a link that is not there.
std::shared_ptr<const RobotModel> load_robot(const RobotSetup& setup, const StereoRig& rig);

/// Straightens pictures of a distorted camera to its own pinhole intrinsics (bilinear); a copy when there
/// is no distortion. Where the camera did not look, see valid(), the picture is mirrored at its border: colours
/// and noise there are those of what lies beside. Maps are computed once.
class Undistorter {
 public:
  explicit Undistorter(const CameraModel& camera);
  /// Throws DataError when the picture's size is not the camera's.
  [[nodiscard]] Image apply(const Image& image) const;
  /// The pixels of a straightened picture that the camera did see.
  [[nodiscard]] BinaryMask valid() const;

 private:
  CameraModel camera_;
  std::vector<float> map_x_, map_y_;
};

}  // namespace bodyschema
