#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <span>
#include <vector>

#include "bodyschema/robot/forward_kinematics.hpp"
#include "bodyschema/robot/robot_setup.hpp"
#include "bodyschema/simulator/kitchen.hpp"
#include "bodyschema/simulator/rasterizer.hpp"
#include "bodyschema/simulator/simulator_settings.hpp"
#include "bodyschema/simulator/true_robot.hpp"

namespace bodyschema::simulator {

/// What stands, lies and moves in the scene beside the robot's own arm: the table and what is on it, what the hand
/// holds, a second arm, a person's arm. Where they are follows from time alone, so that pictures may be drawn in any
/// order; safe to share between threads.
class Things {
 public:
  /// @param arm  the robot's own covers as painted, in the order of RobotModel::meshes
  /// @param q_usual  head and fingers as they usually stand
  Things(const TrueRobot& robot, const RobotSetup& setup, const StereoRig& rig, const SimulatorSettings& settings,
         const std::vector<PaintedPart>& arm, const Eigen::VectorXd& q_usual, std::uint64_t seed);
  ~Things();

  [[nodiscard]] const std::vector<PaintedPart>& parts() const { return parts_; }
  /// One per part, not 0: it throws no shadow (the table, that others' shadows fall on).
  [[nodiscard]] const std::vector<char>& shadowless() const { return shadowless_; }
  /// One per part, not 0: it never moves and is there from the beginning, as the table.
  [[nodiscard]] const std::vector<char>& furniture() const { return furniture_; }
  [[nodiscard]] const RoomPlan& room() const { return room_; }

  /// Poses and presence at a time of the log. One per thread.
  class Placer {
   public:
    explicit Placer(const Things& things);
    /// @param X_WP  the hand then; @param X_WB, hidden  out, one per part
    void place(double t_s, const Pose& X_WP, std::span<Pose> X_WB, std::span<char> hidden);

   private:
    const Things& things_;
    std::unique_ptr<ForwardKinematics> second_arm_;
    std::vector<Pose> X_W_;
  };
  /// Whether the hand holds something at this time.
  [[nodiscard]] bool holding(double t_s) const;

 private:
  struct Crossing {
    double begin_s, end_s;
    Eigen::Vector3d shoulder_W;
    Eigen::Vector3d from_W, to_W, out_W;  // of the person's hand
  };
  struct Sweep;
  void add(PaintedPart part, const Pose& X_WB, bool furniture, bool shadowless = false);
  void plan_room(const SimulatorSettings& settings, const Sweep& sweep, std::uint64_t seed);
  void plan_held(const RobotSetup& setup, const TrueRobot& robot);
  void plan_second_arm(const TrueRobot& robot, const RobotSetup& setup, const StereoRig& rig,
                       const SimulatorSettings& settings, const std::vector<PaintedPart>& arm, const Sweep& sweep,
                       std::uint64_t seed);
  void plan_person(const SimulatorSettings& settings, const Sweep& sweep, std::uint64_t seed);

  std::vector<PaintedPart> parts_;
  std::vector<char> shadowless_, furniture_;
  std::vector<Pose> X_WB_;  // of furniture
  RoomPlan room_;
  double motion_begin_s_ = 0.0;

  HeldThing held_;
  std::size_t held_part_ = 0;
  Pose X_PT_ = Pose::Identity();

  std::shared_ptr<const RobotModel> model_;
  std::vector<std::string> second_links_;
  std::size_t second_part_ = 0;  // the first of them
  std::unique_ptr<Trajectory> second_motion_;
  Eigen::Matrix4d mirror_W_ = Eigen::Matrix4d::Identity();

  std::size_t person_part_ = 0;
  bool person_ = false;
  std::vector<Crossing> crossings_;
};

}  // namespace bodyschema::simulator
