#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bodyschema/robot/forward_kinematics.hpp"
#include "bodyschema/robot/gravity_torques.hpp"
#include "bodyschema/simulator/fault.hpp"
#include "bodyschema/simulator/trajectory.hpp"

namespace bodyschema::simulator {

/// Kinematics of the robot as built. A misplaced joint moves everything beyond it by a transform
/// D, so with nominal poses X the true ones are D_1 ... D_n X, base first. One per thread.
class TrueKinematics {
 public:
  /// Throws ConfigurationError naming an unknown link.
  TrueKinematics(std::shared_ptr<const RobotModel> model, const TrueBody& body, std::vector<std::string> links);

  /// @param q  true joint angles, radians
  /// @param X_WB  out, one pose per link
  void compute(const Eigen::VectorXd& q, std::span<Pose> X_WB);
  /// Pose of a camera from the pose of its link at the last `compute`: the camera may sit beside its place.
  [[nodiscard]] Pose camera(std::size_t index, const Pose& X_WLink) const;

 private:
  struct Misplacement {
    JointMisplacement change;
    std::size_t parent = 0;  // position of the parent link
    double outwards = 1.0;   // +1 when the joint's axis points away from the root, else -1
    Eigen::Vector3d tilt_1_P = Eigen::Vector3d::Zero();
    Eigen::Vector3d tilt_2_P = Eigen::Vector3d::Zero();
  };
  std::size_t link_count_;     // asked for
  std::size_t tracked_count_;  // ... and the mount
  std::unique_ptr<ForwardKinematics> nominal_;
  std::vector<Misplacement> misplacements_;
  std::vector<Pose> X_CT_;
  bool mount_moved_ = false;  // then the mount is the link after those asked for
  Pose X_MK_ = Pose::Identity(), X_KT_ = Pose::Identity();
  Pose X_WM_ = Pose::Identity();  // at the last compute
  std::vector<Pose> tracked_;
  std::vector<Pose> X_W_;
};

/// A robot that carries out a trajectory imperfectly: what its joints really do, what its encoders
/// say, and how it is built, with the given faults. The whole motion is worked out at construction
/// (250 steps a second); reading it is const and safe to share between threads.
class TrueRobot {
 public:
  /// @param rig  cameras as configured
  /// @param trajectory  motor angles from time 0 of the log on
  /// Throws ConfigurationError for faults that cannot be.
  TrueRobot(FaultSite site, const StereoRig& rig, Trajectory trajectory, const std::vector<FaultSpec>& faults);
  TrueRobot(const TrueRobot&) = delete;
  TrueRobot& operator=(const TrueRobot&) = delete;

  /// Joint angles at a time of the log, radians, RobotModel order.
  void joints(double t_s, Eigen::VectorXd& q) const;
  [[nodiscard]] Eigen::VectorXd joints(double t_s) const;
  /// Encoder angles before noise and rounding. Of a stalled encoder they are those of the moment it stalled at.
  void encoders(double t_s, Eigen::VectorXd& encoder) const;
  /// When the encoder of a joint that is stalled at this time began to be so.
  [[nodiscard]] std::optional<double> stalled_since(Eigen::Index joint, double t_s) const;
  /// The motor angles that were asked for.
  [[nodiscard]] const Trajectory& trajectory() const { return trajectory_; }
  [[nodiscard]] const TrueBody& body() const { return body_; }
  [[nodiscard]] const ExposureTiming& timing() const { return timing_; }
  [[nodiscard]] const FaultSite& site() const { return site_; }
  /// Encoder minus true of the constant joint offsets among the faults, radians, RobotModel order.
  [[nodiscard]] const Eigen::VectorXd& offsets() const { return offsets_; }

 private:
  FaultSite site_;
  Trajectory trajectory_;
  TrueBody body_;
  ExposureTiming timing_;
  std::vector<EncoderStall> stalls_;
  std::vector<std::unique_ptr<Fault>> readers_;  // by stage
  Eigen::VectorXd offsets_;
  double start_s_ = 0.0;
  std::vector<Eigen::VectorXd> deflection_;  // joint minus motor, one per step; empty: none
};

}  // namespace bodyschema::simulator
