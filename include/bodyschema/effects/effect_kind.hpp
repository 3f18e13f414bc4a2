#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "bodyschema/effects/effect.hpp"
#include "bodyschema/effects/joint_roles.hpp"

namespace bodyschema {

/// What the encoders of a log show of the motion in it: by it an effect knows whether the log can tell it.
/// Vectors are in RobotModel order.
struct LogMotion {
  std::size_t cameras = 0;          ///< that gave pictures
  bool has_masses = false;          ///< the URDF's: gravity's torques are known
  Eigen::VectorXd range_rad;        ///< of each joint over the pictures
  Eigen::VectorXd torque_range_nm;  ///< of gravity's torque on it; zero without masses
  std::vector<int> reversals;       ///< how often each joint turned round
  double arm_speed_rad_s = 0.0;     ///< root of the summed mean squares over the arm's joints
  double reading_period_s = 0.0;    ///< between the arm's readings, median
  double reading_step_rad = 0.0;    ///< the arm's largest move between two readings, median
  double neck_range_rad = 0.0;      ///< the largest of the joints that move all cameras
};

/// When an effect acts.
enum class EffectTiming {
  kAlways,
  kFromATime,   ///< its second parameter is the time, s since the Unix epoch, at which it begins
  kOverTheLog,  ///< its second and third are when it begins and for how long it grows
};

/// What can hold a correction of an effect outside this software.
enum class EffectHome { kNowhere, kUrdf, kCameras };

/// A kind of effect: everything that the software knows of a cause, in one place. The catalogue's are made in the
/// files of their names in src/effects; a program may register its own (register_effect).
struct EffectKind {
  std::string name;  ///< "link_length"
  /// Every target on which it makes sense for this robot: one per arm joint for most, pairs for couplings, one empty
  /// target for the whole robot, none where the robot lacks the joints.
  std::function<std::vector<EffectTarget>(const JointRoles&)> targets;
  /// The effect with all parameters zero; the target is one that is fit for it.
  std::function<std::unique_ptr<Effect>(const EffectTarget&, const JointRoles&)> make;
  /// The finding as a sentence that a student of robotics understands, without the full stop. `amounts` are the sizes
  /// of its fitted parameters as people read them, without sign: "6.2 mm (5.9 to 6.5)".
  std::function<std::string(const Effect&, const JointRoles&, std::span<const std::string> amounts)> sentence;
  /// Why a log with this motion cannot tell it; empty: it can. Absent: always testable.
  std::function<std::string(const EffectTarget&, const JointRoles&, const LogMotion&)> not_testable{};
  /// Kinds that show alike, and the motion that tells them apart.
  std::vector<std::string> lookalikes{};
  std::string splitting_motion{};
  EffectTiming timing = EffectTiming::kAlways;
  EffectHome home = EffectHome::kNowhere;
  /// No diagnosis looks for it of its own accord: it is estimated where a configuration believes it to be uncertain.
  bool where_believed = false;
  /// The kind that does to all targets alike what this one does to each: both are asked for together, and the fewest
  /// that will do are named.
  std::string each_of{};
  std::string remark{};  ///< what to do about it where no file can hold it
};

/// Adds a kind to the catalogue of this process, before any configuration is read. Throws ConfigurationError where
/// there is one of that name.
void register_effect(EffectKind kind);

/// Kinds of the catalogue, joint_offset first, registered ones last.
std::vector<std::reference_wrapper<const EffectKind>> effect_kinds();
/// Throws ConfigurationError naming the nearest effect.
const EffectKind& effect_kind(const std::string& name);
/// Names of all kinds.
std::vector<std::string> effect_names();
/// An effect of the catalogue with all parameters zero. Throws ConfigurationError naming the
/// nearest effect or joint, or saying what target the effect needs.
std::unique_ptr<Effect> make_effect(const std::string& name, const EffectTarget& target, const JointRoles& roles);
/// effect_kind(name).targets(roles)
std::vector<EffectTarget> effect_targets(const std::string& name, const JointRoles& roles);

}  // namespace bodyschema
