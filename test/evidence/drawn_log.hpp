#pragma once

#include <memory>
#include <random>
#include <vector>

#include "bodyschema/evidence/log_fit.hpp"
#include "outline/own_robot.hpp"
#include "outline/synthetic_reach.hpp"

namespace bodyschema {

/// Logs of our own robot in postures all over the view, its masks drawn.
class DrawnLog : public OwnRobot {
 protected:
  DrawnLog() : roles_(JointRoles::of(robot_, setup_, rig_)) {}

  /// Joint angles of a posture: arm and head a little elsewhere in each.
  [[nodiscard]] Eigen::VectorXd posture(int i) const {
    std::mt19937 random(static_cast<unsigned>(100 + i));
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    Eigen::VectorXd q = pose(0.5 + uniform(random));
    const auto turn = [&](const char* joint, double deg) {
      q(robot_->joint_index(joint)) += radians(deg) * uniform(random);
    };
    turn("r_shoulder_roll", 5.0);
    turn("r_shoulder_yaw", 8.0);
    turn("r_elbow", 8.0);
    turn("r_wrist_prosup", 40.0);
    turn("r_wrist_pitch", 15.0);
    turn("r_wrist_yaw", 10.0);
    turn("neck_pitch", 4.0);
    turn("neck_yaw", 4.0);
    return q;
  }
  /// A robot with these offsets and whatever else is wrong with it, a posture each second.
  [[nodiscard]] std::vector<Observation> observe(int postures, const Eigen::VectorXd& offset_rad,
                                                 const ErrorModel* others = nullptr) const {
    SyntheticReach reach(robot_, setup_, rig_, offset_rad);
    if (others != nullptr) reach.befall(*others);
    std::vector<Observation> list;
    for (int i = 0; i < postures; ++i) list.push_back(reach.observe(posture(i), 1'000'000 * (i + 1)));
    return list;
  }
  [[nodiscard]] std::unique_ptr<PictureLog> log_of(const std::vector<Observation>& observations) const {
    auto log = std::make_unique<PictureLog>(robot_, setup_, rig_);
    for (const auto& observation : observations) log->add(observation);
    log->finish();
    return log;
  }
  /// Beliefs about the offsets, and about more.
  [[nodiscard]] std::vector<Belief> beliefs(const std::vector<Belief>& more = {}) const {
    std::vector<Belief> list;
    for (const auto& target : effect_targets("joint_offset", roles_))
      list.push_back({"joint_offset", target, {radians(5.0)}});
    list.insert(list.end(), more.begin(), more.end());
    return list;
  }

  JointRoles roles_;
};

}  // namespace bodyschema
