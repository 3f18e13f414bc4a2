#pragma once

#include <Eigen/Core>
#include <array>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bodyschema/camera/stereo_rig.hpp"
#include "bodyschema/robot/forward_kinematics.hpp"
#include "bodyschema/robot/robot_setup.hpp"
#include "bodyschema/simulator/random.hpp"
#include "bodyschema/simulator/trajectory.hpp"

namespace bodyschema::simulator {

/// Where the hand may go and how the head stands.
struct MotionSettings {
  /// Hand centre to the middle between the eyes; 0: where the cameras see the hand of this robot.
  double distance_min_m = 0.0;
  double distance_max_m = 0.0;
  double border_px = 6.0;                     ///< hand base and fingertips stay this far inside the pictures
  double hand_radius_m = 0.075;               ///< room kept around the hand's centre when targets are chosen
  std::map<std::string, double> posture_deg;  ///< head and fingers; joints left out: RobotSetup's
  double head_motion_deg = 4.0;               ///< a moving head turns each joint by up to this
  double gaze_range_deg = 18.0;               ///< a head that follows the hand turns neck and eyes by up to this
  int postures = 0;          ///< babbling holds at least this many distinct postures for a second; 0: as it comes
  double slow_deg_s = 18.0;  ///< mean speed of the fastest joint in slow moves
  double fast_deg_s = 55.0;  ///< ... and in fast ones
  double hold_s = 15.0;      ///< standing still within a long babble, to measure noise
};

/// What the head does.
enum class Head {
  kStill,
  kMoving,  ///< sways about its usual posture, the hand anywhere in view
  kGaze,    ///< follows the hand: it stays in the middle of the pictures
};

/// Finds motions of the nominal robot that the cameras can see: postures by inverse kinematics
/// from random starts, moves between them checked on the way. Seeded. One thread.
class MotionPlanner {
 public:
  /// @param frozen  arm joints that stay where they are
  /// Throws DataError when distances are to be found and no posture shows the hand to the cameras, ConfigurationError
  /// for a gaze without joints that turn the cameras.
  MotionPlanner(std::shared_ptr<const RobotModel> model, const RobotSetup& setup, const StereoRig& rig,
                MotionSettings settings, std::uint64_t seed, Head head = Head::kStill,
                const std::vector<std::string>& frozen = {});

  /// The hand crosses the image from lower right to upper left, forearm visible.
  /// Throws DataError when the robot cannot do that within the settings.
  Trajectory reach(double duration_s);
  /// Smooth random motion with the hand in view: slow and fast, a tour of four postures there and
  /// back at the beginning and again in the middle and at the end, and a static hold (the last three
  /// when there is time: 40 s or more). With MotionSettings::postures instead: so many postures and more while there
  /// is time, each held for a second (less where time is short), slow and fast moves between them.
  Trajectory babble(double duration_s);
  /// Stop and go: so many postures with the hand in view, each held still for a second, fast moves between
  /// them.
  Trajectory poses(int count);
  /// A posture with the arm out of both views; head as in `like`.
  Eigen::VectorXd rest_posture(const Eigen::VectorXd& like);
  /// Head and fingers as they usually stand, arm at its default.
  [[nodiscard]] const Eigen::VectorXd& usual_posture() const { return base_; }
  /// An arm posture with the hand in view, head at its usual place.
  Eigen::VectorXd visible_posture();

  /// What the cameras see of the nominal robot.
  struct View {
    bool whole_hand = false;                             ///< hand base and fingertips inside both pictures
    bool forearm = false;                                ///< the forearm next to the wrist is inside both pictures
    double distance_m = 0.0;                             ///< hand centre to the middle between the eyes
    Eigen::Vector3d centre_W = Eigen::Vector3d::Zero();  ///< of the hand
    std::vector<Eigen::Vector2d> centre_px;              ///< hand centre in each camera
  };
  View view(const Eigen::VectorXd& q);
  /// Moves the arm joints of `q` until the hand's centre (mean of base and fingertips) is at
  /// `centre_W` within 2 mm. False when it cannot be reached from there.
  bool solve(const Eigen::Vector3d& centre_W, Eigen::VectorXd& q);
  /// A point in front of the eyes, root frame.
  /// @param pixel  where it appears, mean of all cameras; @param distance_m  from between the eyes
  Eigen::Vector3d point_in_view(const Eigen::Vector2d& pixel, double distance_m, const Eigen::VectorXd& q);
  /// With the distances in force.
  [[nodiscard]] const MotionSettings& settings() const { return settings_; }

 private:
  struct Range {
    double min_m, max_m;
  };
  /// Distances of the hand in postures drawn at random that show it: the nearer half. Nothing: hardly
  /// any posture does.
  std::optional<Range> seen_distances();
  void compute(const Eigen::VectorXd& q);
  Eigen::VectorXd random_arm(const Eigen::VectorXd& like, double share);
  Eigen::VectorXd move_head(Eigen::VectorXd q);
  bool good(const View& view) const;
  double share_in_view(const Eigen::VectorXd& from, const Eigen::VectorXd& to, double* forearm);
  Eigen::Vector3d random_target(const Eigen::VectorXd& q, double u_low, double u_high, double v_low, double v_high);
  Eigen::VectorXd next_posture(const Eigen::VectorXd& from);
  Trajectory held_babble(double duration_s);
  double travel_time(const Eigen::VectorXd& from, const Eigen::VectorXd& to, double speed_deg_s) const;

  std::shared_ptr<const RobotModel> model_;
  StereoRig rig_;
  MotionSettings settings_;
  Random random_;
  Head head_mode_;
  std::vector<Eigen::Index> arm_;
  std::vector<Eigen::Index> head_;
  std::vector<Eigen::Index> gaze_;  // those of them that look elsewhere rather than tilt the picture
  std::size_t tips_;
  bool has_forearm_;
  std::unique_ptr<ForwardKinematics> kinematics_;  // hand, tips, [wrist, forearm], cameras
  std::vector<Pose> X_W_;
  Eigen::VectorXd base_;
};

}  // namespace bodyschema::simulator
