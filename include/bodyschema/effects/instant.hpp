#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <utility>

#include "bodyschema/core/time.hpp"
#include "bodyschema/observation/corrections.hpp"
#include "bodyschema/observation/observation.hpp"
#include "bodyschema/robot/robot_setup.hpp"
#include "bodyschema/robot/forward_kinematics.hpp"
#include "bodyschema/robot/gravity_torques.hpp"

namespace bodyschema {

/// What effects may look at: one camera's exposure.
struct Instant {
  Microseconds utime = 0;
  std::size_t camera = 0;   ///< 0 left, 1 right
  Eigen::VectorXd encoder;  ///< as read, radians, RobotModel order
  Eigen::VectorXd q;        ///< encoder minus the offsets believed at present, radians
  Eigen::VectorXd qdot;     ///< rad/s
  Eigen::VectorXd qddot;    ///< rad/s^2
  /// Torque of gravity on each joint at `q`, Nm. Empty when the URDF has no masses.
  Eigen::VectorXd gravity_torque;
  /// Torque on each joint of one kilogram at the hand's frame, Nm/kg. Empty without a hand link.
  Eigen::VectorXd payload_torque;
  /// joint_path() about the instant, where samples after it are known, as in a log; else empty.
  Eigen::MatrixXd path;

  /// One of an arm that stands, whose encoders are right and on which nothing pulls.
  static Instant at_rest(const Eigen::VectorXd& q, std::size_t camera);

  /// Shows the joints so much later (negative: earlier) than `c` has them: along their paths, and by velocity and
  /// acceleration where these are not known. Times add up: of a picture that is late and skewed the path is followed
  /// once, by both together.
  void show_later(double after_s, Corrections& c) const;
};

/// Gravity acts on the arm where it stands, sagged: takes the torques where the corrections have the arm until both
/// agree, within what no encoder reads.
/// @param joints  -> corrections of all joints, rad, under the torques as they are
/// @param take_torques  (corrections of all joints): those of the arm there
template <class Joints, class TakeTorques>
void settle_under_gravity(Joints&& joints, TakeTorques&& take_torques) {
  constexpr int kRounds = 10;  // a joint that gives way by a third of its torque's change is there to 1e-5
  constexpr double kSettled_rad = 1e-5;
  Eigen::VectorXd before;
  for (int round = 0; round < kRounds; ++round) {
    Eigen::VectorXd now = joints();
    if (round > 0 && (now - before).cwiseAbs().maxCoeff() < kSettled_rad) return;
    take_torques(now);
    before = std::move(now);
  }
}

/// Fills in the torques of an Instant. One per thread.
class InstantBuilder {
 public:
  /// @param hand_link  frame at which a load is held; empty: none
  /// @param gravity_W  m/s^2, root frame
  InstantBuilder(std::shared_ptr<const RobotModel> model, const std::string& hand_link,
                 const Eigen::Vector3d& gravity_W);

  /// Sets the acceleration to zero; who knows it fills it in.
  /// @param offsets  believed joint offsets (encoder = true + offset), radians, RobotModel order
  void build(const JointSample& sample, std::size_t camera, const Eigen::Ref<const Eigen::VectorXd>& offsets,
             Instant& out);

 private:
  std::shared_ptr<const RobotModel> model_;
  Eigen::Vector3d gravity_W_;
  GravityTorques torques_;
  std::unique_ptr<ForwardKinematics> hand_;
};

}  // namespace bodyschema
