#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "bodyschema/camera/stereo_rig.hpp"
#include "bodyschema/observation/corrections.hpp"
#include "bodyschema/robot/robot_setup.hpp"

namespace bodyschema {

/// Rendered parts that keep their places to each other when the arm's joints move: one body of the arm, with
/// fingers counted to the hand.
struct BodySegment {
  std::string name;  ///< its first rendered link, from the root outwards; of the hand RobotSetup::hand_link
  std::vector<std::size_t> parts;    ///< positions in RobotSetup's rendered links
  std::vector<std::size_t> inner{};  ///< of an arm's last one, those that joints within it move: fingers
  std::size_t core = 0;              ///< the part that carries these: the palm
};

/// A link between two joints of the arm that lie apart, and how its length changes: by the joint at its far end, which
/// alone moves. Of a link that turns about its own length also by the joint that turns it: that moves with all beyond,
/// the link's cover first.
struct ArmLink {
  std::string name;           ///< the URDF's link between them
  Eigen::Index joint = -1;    ///< the joint that moves, RobotModel order
  double length_m = 0.0;      ///< from joint to joint
  JointAdjustment per_metre;  ///< of `joint`: what one metre more of length does
  bool takes_cover = false;   ///< `joint` turns the link
};

/// What is fixed to the last link of an arm: a hand, a tool.
struct Mount {
  std::string link;         ///< the first rendered link, or the hand's frame, that is fixed to the arm's last one
  Eigen::Index joint = -1;  ///< that turns the arm's last link, RobotModel order
  /// Unit, frame of the arm's last link: from its origin to `link`'s, or the joint's axis where these are one.
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();
};

/// Which joints and parts play which role on this robot, by position in RobotModel order; in that order too, so from
/// the root outwards, however a configuration lists them.
struct JointRoles {
  std::vector<std::string> names;    ///< every joint of the model
  std::vector<std::string> cameras;  ///< names, in the rig's order
  std::vector<Eigen::Index> arm;     ///< shoulder to wrist, the joints whose offsets are estimated
  std::vector<Eigen::Index> head;    ///< every joint of neck and eyes
  std::vector<Eigen::Index> neck;    ///< those of the head that move every camera (eyes' tilt too)
  /// Moves the left camera alone; of several the one whose axis is nearest to the y axis of its picture at
  /// RobotSetup::default_joints. -1: none.
  Eigen::Index left_pan = -1;
  Eigen::Index right_pan = -1;        ///< the same of the right camera
  std::vector<Eigen::Index> fingers;  ///< joints that curl a finger when they grow
  std::vector<Eigen::Index> hand;     ///< those and the ones that spread the fingers or oppose the thumb
  std::vector<BodySegment> segments;  ///< every rendered part is in one
  std::vector<ArmLink> links;         ///< from the root outwards
  std::vector<Mount> mounts;          ///< of each arm whose hand is fixed to its last link
  /// The roles that a configuration gives: arm and head as named there, neck and pans by what they move.
  /// Fingers are the joints that turn a rendered link but not the hand's frame, about an axis within 45
  /// deg of their finger's last one: joints that spread the fingers, oppose the thumb or slide are none.
  /// Throws ConfigurationError naming the nearest joint.
  static JointRoles of(std::shared_ptr<const RobotModel> model, const RobotSetup& setup, const StereoRig& rig);
  [[nodiscard]] bool has_pans() const { return left_pan >= 0 && right_pan >= 0; }
  /// Throws ConfigurationError naming the nearest joint.
  [[nodiscard]] Eigen::Index index(const std::string& name) const;
  /// Corrections of this robot, all zero.
  [[nodiscard]] Corrections no_corrections() const {
    return Corrections(static_cast<Eigen::Index>(names.size()), segments.size());
  }
};

}  // namespace bodyschema
