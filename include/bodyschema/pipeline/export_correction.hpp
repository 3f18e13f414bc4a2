#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "bodyschema/camera/stereo_rig.hpp"
#include "bodyschema/effects/error_model.hpp"
#include "bodyschema/estimator/estimate.hpp"
#include "bodyschema/robot/robot_setup.hpp"

namespace bodyschema {

/// A joint that sits elsewhere than the URDF has it.
struct JointPlacement {
  std::string joint;
  double along_m = 0.0;                               ///< moved along its own axis
  Eigen::Vector3d shift_m = Eigen::Vector3d::Zero();  ///< moved, parent frame
  Eigen::Vector3d tilt = Eigen::Vector3d::Zero();     ///< its axis turned; rotation vector, parent frame
};

/// A result in the forms in which people apply it.
struct Correction {
  /// encoder - true, by joint name, rad.
  std::vector<std::pair<std::string, double>> offsets_rad;
  std::vector<std::pair<std::string, double>> sd_rad;
  /// What else was estimated; it holds together with the offsets: without the head's, those of the arm would be wrong.
  std::vector<EstimatedParameter> effects;
  /// What whoever applies it must know, one line each; stands in every file.
  std::vector<std::string> warnings;

  // What effects, estimated or of an extended model, add that a URDF can hold.
  std::vector<std::pair<std::string, double>> known_offsets_rad;  ///< encoder - true, by joint
  std::vector<JointPlacement> placements;
  /// Of links that are fixed to their parents, cameras and hands, by link: the corrected frame in the URDF's.
  std::vector<std::pair<std::string, Pose>> frame_motions;
};

/// One effect, estimated or of an extended model, and what the exported files make of it.
struct AppliedEffect {
  std::string effect;   ///< "link_length of r_shoulder_yaw change 2.1 mm"
  std::string applied;  ///< file that holds it; empty: none
  std::string remark;   ///< why not, or what else can be done
};

/// Reads the final offsets from a replay's `summary.json`; warns of joints that are hardly known.
/// @param anyway  also of a replay that did not end converged, with a warning
/// Throws FileError naming file and key, DataError when the replay did not end converged.
Correction read_correction(const std::filesystem::path& summary, bool anyway = false);

/// Adds to `correction` what a URDF can hold of some effects, and says of every one where it
/// went. Joint offsets are left out: those of the replay count.
std::vector<AppliedEffect> add_effects(const ErrorModel& model, const std::shared_ptr<const RobotModel>& robot,
                                       const RobotSetup& setup, const StereoRig& rig, Correction& correction);

/// The rig with intrinsics and places as `model` has them. Cameras that are links of the URDF stay where their link is:
/// corrected.urdf moves that. What has been estimated is known then (CameraMount::knowledge).
StereoRig corrected_rig(const ErrorModel& model, const std::shared_ptr<const RobotModel>& robot,
                        const RobotSetup& setup, const StereoRig& rig);

/// A copy of the URDF that is right when it is fed the encoders as they are: every corrected joint's
/// origin is turned back by its offset about its axis (moved, for a sliding joint) and its limits
/// grow by it, so that FK_corrected(encoder) = FK_nominal(encoder - offset). Placements and shifts
/// of an extended model move origins and axes. Everything else stays as it was. Relative mesh paths
/// keep resolving only beside the original.
/// Throws FileError naming URDF and joint, and as replace_file (core/write_file.hpp) where `out` cannot be written.
void write_corrected_urdf(const std::filesystem::path& urdf, const Correction& correction,
                          const std::filesystem::path& out);

/// Writes `offsets.yaml` (by joint, deg), `corrected.urdf`, `ros/` (write_ros_files) and `calibration_delta.txt` (what
/// to add to each joint's calibrationDelta in an iCub's calibrator file, deg) into `out`, head joints that were
/// estimated included: arm and head offsets hold together. With other effects also `cameras.yaml` (where these change
/// intrinsics or cameras' places) and `what_was_applied.txt`: which of its effects these files hold, and which only
/// work where the model itself is loaded. Each file is written whole or, where that fails, stays as it was.
/// @param anyway  as of read_correction, and also when the summary's `model_hash` is another robot's or its cameras are
///                others than `rig`, with a warning
/// Throws as read_correction does, as replace_file for a file that cannot be written, and ConfigurationError when the
/// summary was made with another URDF, other meshes, other cameras or another extended model than `setup` and `rig`
/// have. Returns warnings and files, for people.
std::string export_correction(const std::filesystem::path& summary, const RobotSetup& setup, const StereoRig& rig,
                              const std::filesystem::path& out, bool anyway = false);

}  // namespace bodyschema
