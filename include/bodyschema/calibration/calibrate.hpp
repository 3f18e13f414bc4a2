#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "bodyschema/core/configuration.hpp"
#include "bodyschema/core/time.hpp"
#include "bodyschema/effects/error_model.hpp"
#include "bodyschema/geometry/pinhole.hpp"
#include "bodyschema/geometry/pose.hpp"

namespace bodyschema {

struct CalibrationOptions {
  std::filesystem::path log;
  std::filesystem::path out;  ///< folder, created
  /// The file that the configuration was read from: estimator.yaml in `out` includes it, with the cameras as found
  /// behind it. Empty: none is written.
  std::filesystem::path configuration;
  double picture_rate_hz = 5.0;
  bool all_parameters = false;  ///< what the pictures do not tell goes into the files as well
  int threads = 0;              ///< 0: one per core
  bool quiet = false;           ///< no progress bar
};

/// How a calibration ended; `to_string` gives the name used in files.
enum class CalibrationState {
  kGood,          ///< postures agree within what is claimed
  kModelMisfit,   ///< they agree only if something is wrong by more than is believed possible
  kNotConverged,  ///< outlines and model were not brought together, or not in one way alone
};
const char* to_string(CalibrationState state);

/// Distances between predicted and observed outlines, median, px of the picture.
struct OutlineDistances {
  double before = 0.0;  ///< encoders and model as they are
  double after = 0.0;
  /// Of postures that the fit had not seen, in up to five parts of the log, each left out in turn: median of the parts,
  /// and the worst of them.
  std::optional<double> heldout, heldout_worst;
};

/// A camera as the calibration found it.
struct CalibratedCamera {
  std::string name;
  std::string link;                        ///< that carries it
  Pose X_link_optical = Pose::Identity();  ///< OpenCV axes, m
  PinholeIntrinsics intrinsics;            ///< px, as estimated
  std::array<double, 5> distortion{};      ///< k1 k2 p1 p2 k3 as OpenCV, as estimated
  double sd_m = 0.0;                       ///< root of the summed variances of its place in the link's frame
  double sd_rad = 0.0;                     ///< ... of its rotation
  /// One standard deviation along and about each of the camera's own axes.
  Eigen::Vector3d axes_sd_m = Eigen::Vector3d::Zero(), axes_sd_rad = Eigen::Vector3d::Zero();
  /// The same if the arm's first joint were known: where the camera does not move with the robot's base, no picture
  /// tells that joint from a turn of the camera about its axis, and both figures above contain the turn.
  double sd_m_beside_first_joint = 0.0, sd_rad_beside_first_joint = 0.0;
  /// Of a camera that is configured beside the rig's first: its place there, and that one's name.
  struct Beside {
    std::string camera;
    Pose X_first_optical = Pose::Identity();
    Eigen::Vector3d axes_sd_m = Eigen::Vector3d::Zero(), axes_sd_rad = Eigen::Vector3d::Zero();  ///< as above
    bool estimated = false;  ///< false: as configured, against that camera
  };
  std::optional<Beside> beside;
  bool estimated = false;  ///< false: as configured
};

/// Where the calibrated robot has its hand in one picture: for a witness of one's own, a board that the hand carries.
struct CalibratedView {
  Microseconds utime = 0;
  std::size_t camera = 0;
  Pose X_camera_hand = Pose::Identity();  ///< camera in OpenCV axes, m; lag and all else that was found taken in
};

/// One joint's offset: encoder = true + offset.
struct CalibratedJoint {
  std::string name;
  /// As it is to be applied, and the root of its mean squared error: zero, and how far off that may be, where the joint
  /// is left as it is. All else is right together with this.
  double offset_rad = 0.0, sd_rad = 0.0;
  bool told = false;       ///< known to 0.5 deg and a third of what was believed; counts in a good result
  std::string untold_why;  ///< "no picture tells it from camera_pose turn_y"; empty where it is told
  /// Told; or told too little, and further from where it is than the pictures leave open.
  bool applied = false;
  double seen_rad = 0.0, seen_sd_rad = 0.0;  ///< what the pictures make of it, whether it is applied or not
};

/// Another parameter that was estimated beside the joints' offsets.
struct CalibratedParameter {
  std::string name, unit;                        ///< "silhouette_bias", "px"
  double value = 0.0, sd = 0.0, prior_sd = 0.0;  ///< in that unit
};

/// Something that the pictures ask for besides: a cause that the diagnosis names.
struct CalibratedEffect {
  std::string effect, joint, source;  ///< as in the catalogue; empty where it has no such target
  std::string sentence;               ///< "pictures arrive 58 ms (57 to 59) late against the encoders"
  std::vector<CalibratedParameter> parameters;
};

/// How far an arm is built otherwise than its URDF says, in many small ways that no picture names, as a log tells: one
/// standard deviation of all joints' places and axes.
struct ArmBuild {
  double beside_sd_m = 0.0, tilted_sd_rad = 0.0;
  bool estimated = false;  ///< the pictures speak for it: each place was estimated; otherwise it was considered only
};

/// The answer of a whole log or a folder of stills.
struct Calibration {
  CalibrationState state = CalibrationState::kNotConverged;
  std::string sentence;  ///< good enough for what, or what to do
  std::vector<CalibratedJoint> joints;
  std::vector<CalibratedCamera> cameras;
  std::vector<CalibratedParameter> parameters;
  std::vector<CalibratedEffect>
      effects;                        ///< what else was found; estimated with the rest where they do not depend on time
  std::optional<ArmBuild> arm_build;  ///< nothing: as the configuration has it, or too few postures
  std::optional<ErrorModel> model;    ///< all that was estimated, together
  OutlineDistances outline_px;
  double hand_sd_m = 0.0;             ///< of the hand's place in the first camera's picture, mean over postures
  std::vector<CalibratedView> views;  ///< of all pictures, in order of time
  std::size_t postures = 0, pictures = 0;
  double dispersion = 1.0;      ///< how postures disagree, by what is claimed; 1: as claimed
  double posture_sd_rad = 0.0;  ///< what a posture gets wrong, per joint
  double outline_sd_px = 0.0, outline_points_alike = 0.0;
  std::vector<std::string> remarks;                ///< what limits it, what to look at
  std::map<std::string, double> next_posture_rad;  ///< what to record next, by joint; empty: nothing better was found
  std::string next_posture_for;                    ///< the joint whose offset it would tell best
};

/// Calibrates a robot from a log: offsets of its joints, poses and intrinsics of its cameras as far as they are
/// believed uncertain (`cameras: pose`, `estimator.state`), by the outlines in all pictures at once. A camera of which
/// nothing is known is searched for.
///
/// Writes calibration.json, report.html, corrected.urdf, offsets.yaml, cameras.yaml, estimator.yaml, ros/
/// (write_ros_files) into `out`. Throws Error.
Calibration calibrate(const Configuration& configuration, const CalibrationOptions& options);

/// The result as a table for people.
std::string to_table(const Calibration& calibration);

}  // namespace bodyschema
