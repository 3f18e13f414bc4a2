#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "bodyschema/camera/stereo_rig.hpp"
#include "bodyschema/core/configuration.hpp"
#include "bodyschema/robot/robot_model.hpp"

namespace bodyschema {

/// What the names of a source mean: the `import` section of a configuration, or of a file of its own. Names that are
/// the robot's already need no word here.
///
///     import:
///       unit: deg                       # of joints that turn, where no scale is given; rad unless said
///       joints:                         # column or name in the source: joint of the URDF
///         kLeftElbow: left_elbow_joint
///         L_pinky: {joint: L_pinky_proximal_joint, scale: -1.7, offset: 1.7}   # rad = scale * value + offset
///         gripper: "-"                  # left out, and not asked about
///       cameras:                        # camera of the configuration: where its pictures are
///         left: /zed/left/image_rect    # a topic, a folder of images/, a column of a data set
///       masks:
///         left: /segmentation/left
struct JointMapping {
  static constexpr const char* kUnused = "-";  ///< in place of a joint: left out
  struct Rule {
    std::string joint;            ///< of the URDF; empty: left out
    std::optional<double> scale;  ///< rad (m) per unit of the source; absent: that of `in_degrees`
    double offset = 0.0;          ///< rad (m), added after scaling
  };
  std::map<std::string, Rule> joints;          ///< by the source's name
  std::map<std::string, std::string> cameras;  ///< source's name of pictures, by camera
  std::map<std::string, std::string> masks;    ///< source's name of masks, by camera
  bool in_degrees = false;

  /// Reads the `import` section. Throws ConfigurationError.
  static JointMapping from(const Configuration& import);
  /// That joints and cameras on the robot's side are there. @param import  as it was read from, for the place
  /// Throws ConfigurationError naming file, key, value and what was expected.
  void check_names(const Configuration& import, const RobotModel& robot, const StereoRig& rig) const;
};

}  // namespace bodyschema
