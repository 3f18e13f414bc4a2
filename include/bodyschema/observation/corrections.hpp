#pragma once

#include <Eigen/Core>
#include <vector>

namespace bodyschema {

/// What a camera is, minus what the configuration says.
struct CameraCorrection {
  /// The rig, all cameras together as they are fixed to each other, moved along and turned about the first
  /// camera's axes: metres, rotation vector in radians.
  Eigen::Vector3d rig_shift_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d rig_turn_rad = Eigen::Vector3d::Zero();
  /// This camera alone, along and about its own axes.
  Eigen::Vector3d shift_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d turn_rad = Eigen::Vector3d::Zero();
  double focal_scale = 0.0;  ///< fx and fy are multiplied by 1 + this
  double cx_px = 0.0;        ///< principal point, px of the camera's own pictures (PinholeIntrinsics::reduction)
  double cy_px = 0.0;        ///< principal point, the same
  double k1 = 0.0;           ///< radial distortion, added to the camera's own
  double readout_s = 0.0;    ///< the last row of a picture is exposed this much later than the first
};

/// A small constant transform at a joint, between its parent link and its rotation.
struct JointAdjustment {
  double along_m = 0.0;     ///< the joint (and all beyond) moved along its own axis, away from the root, metres
  double tilt_1_rad = 0.0;  ///< tilt of the joint's axis in its parent link, about `tilt_axis(0)`
  double tilt_2_rad = 0.0;  ///< ... about `tilt_axis(1)` of CorrectedKinematics
  double shift_1_m = 0.0;   ///< the joint (and all beyond) moved along `tilt_axis(0)`, metres
  double shift_2_m = 0.0;   ///< ... along `tilt_axis(1)`
  /// What is fixed to the link that the joint turns, and all beyond, is mounted otherwise: moved along and turned about
  /// (rotation vector) that link's axes at its origin; the link itself stays.
  Eigen::Vector3d mount_shift_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d mount_turn_rad = Eigen::Vector3d::Zero();
  [[nodiscard]] bool mounts() const { return !mount_shift_m.isZero(0.0) || !mount_turn_rad.isZero(0.0); }
  /// Of the joint itself.
  [[nodiscard]] bool is_zero() const {
    return along_m == 0 && tilt_1_rad == 0 && tilt_2_rad == 0 && shift_1_m == 0 && shift_2_m == 0;
  }
};

/// What the rendered parts of one segment of the body (JointRoles::segments) look like, minus what their meshes say.
struct ShapeCorrection {
  double scale = 0.0;  ///< parts are scaled by 1 + this about their own frames
  /// Of a segment with joints within: its core and what these joints move are 1 + this times as large, the places of
  /// the joints with them, about the core's frame.
  double size = 0.0;
  /// The observed outline lies this far outside the predicted one, px of the camera's own pictures.
  double dilation_px = 0.0;
  /// The surface lies this far outside that of the meshes, along its normals: what covers it.
  double thickness_m = 0.0;
};

/// Everything in which the prediction of one camera's picture at one instant departs from what URDF
/// and configuration say. All zero means: as they say. Effects (storey `effects`) add to it; the sum
/// is applied.
///
/// Sign everywhere: true minus assumed, so `q_true = q_encoder + dq` (a joint offset of +3 deg,
/// encoder = true + offset, is dq = -3 deg).
struct Corrections {
  Eigen::VectorXd dq;  ///< radians, RobotModel order
  /// The picture was taken so much later than its stamp says, s, by all that says so: what it moves is in `dq` already
  /// (Instant::show_later).
  double later_s = 0.0;
  std::vector<JointAdjustment> adjustments;  ///< RobotModel order
  /// The arm stands this much further along the root's axes, seen from the eyes, metres.
  Eigen::Vector3d base_shift_m = Eigen::Vector3d::Zero();
  CameraCorrection camera;
  std::vector<ShapeCorrection> shapes;  ///< one per segment
  /// How the joints move while a picture is read out, rad/s, RobotModel order; empty: they rest. What is known of the
  /// instant, no correction: rows of a moving arm lie beside where its middle row says.
  Eigen::VectorXd qdot;

  explicit Corrections(Eigen::Index joint_count = 0, std::size_t segment_count = 1)
      : dq(Eigen::VectorXd::Zero(joint_count)), adjustments(static_cast<std::size_t>(joint_count)),
        shapes(segment_count) {}
  /// Back to zero; allocates nothing.
  void clear() {
    dq.setZero();
    later_s = 0.0;
    for (auto& a : adjustments) a = {};
    base_shift_m.setZero();
    camera = {};
    for (auto& s : shapes) s = {};
    qdot.resize(0);
  }
};

}  // namespace bodyschema
